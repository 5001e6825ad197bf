// B612, drawn for cockpits, from Debian's fonts-b612: read once, rasterised again whenever the scale changes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "app/console/widgets/theme.h"

namespace knuckle::console::widgets {

class FontFiles {
 public:
  /// @throws InputError naming the file where one is missing or is no font. The folder is $KNUCKLE_FONT_DIR, or
  /// Debian's.
  FontFiles();
  /// Fills ImGui's atlas for this scale; the caller uploads it.
  [[nodiscard]] Fonts build(ImFontAtlas& atlas, float scale);

 private:
  ImFont* add(ImFontAtlas& atlas, std::size_t face, float size_px);
  std::array<std::vector<char>, 3> faces_;  ///< Regular, bold, mono.
};

}  // namespace knuckle::console::widgets
