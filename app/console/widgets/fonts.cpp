#include "app/console/widgets/fonts.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "core/error.h"

namespace knuckle::console::widgets {
namespace {

constexpr std::array<const char*, 3> kFiles{"B612-Regular.otf", "B612-Bold.otf", "B612Mono-Bold.otf"};
constexpr std::size_t kRegular = 0, kBold = 1, kMono = 2;
constexpr const char* kDebianFolder = "/usr/share/fonts/opentype/b612";

// Latin, Greek letters, and the few signs that the screens use.
constexpr std::array<ImWchar, 19> kGlyphs{0x20,   0x7E,   0xA0,   0xFF,   0x391,  0x3C9,  0x2010,
                                          0x2026, 0x2030, 0x2030, 0x2190, 0x2195, 0x2212, 0x2212,
                                          0x2248, 0x2248, 0x2264, 0x2265, 0};

std::vector<char> read_font(const std::string& folder, const char* file) {
  const std::string path = folder + "/" + file;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw InputError("font " + path + " is missing: install fonts-b612, or set KNUCKLE_FONT_DIR");
  std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
  // What is no font would end the program inside the rasteriser.
  const std::string magic(bytes.begin(), bytes.begin() + std::min<std::ptrdiff_t>(4, std::ssize(bytes)));
  constexpr std::size_t kSmallest = 1024;
  if ((magic != "OTTO" && magic != std::string("\0\1\0\0", 4)) || bytes.size() < kSmallest)
    throw InputError("font " + path + " is not an OpenType font: install fonts-b612, or set KNUCKLE_FONT_DIR");
  return bytes;
}

/// A mono font's point leaves a hole in every number: "1. 47". Numbers have as many points whatever they are, so a
/// narrower one keeps them from dancing as well.
void narrow_point(ImFont& font) {
  constexpr float kShare = 0.55F;
  for (const ImWchar c : {ImWchar{'.'}, ImWchar{','}, ImWchar{':'}}) {
    auto* glyph = const_cast<ImFontGlyph*>(font.FindGlyphNoFallback(c));
    if (glyph == nullptr) continue;
    const float advance = std::round(glyph->AdvanceX * kShare);
    const float shift = std::round((advance - (glyph->X1 - glyph->X0)) / 2 - glyph->X0);
    glyph->X0 += shift;
    glyph->X1 += shift;
    glyph->AdvanceX = advance;
    font.IndexAdvanceX[c] = advance;
  }
}

}  // namespace

FontFiles::FontFiles() {
  const char* asked = std::getenv("KNUCKLE_FONT_DIR");
  const std::string folder = asked != nullptr && *asked != '\0' ? asked : kDebianFolder;
  for (std::size_t i = 0; i < faces_.size(); ++i) faces_[i] = read_font(folder, kFiles[i]);
}

ImFont* FontFiles::add(ImFontAtlas& atlas, std::size_t face, float size_px) {
  ImFontConfig config;
  config.FontDataOwnedByAtlas = false;
  config.OversampleH = 2;
  config.OversampleV = 1;
  std::vector<char>& bytes = faces_[face];
  return atlas.AddFontFromMemoryTTF(bytes.data(), static_cast<int>(bytes.size()), std::round(size_px), &config,
                                    kGlyphs.data());
}

Fonts FontFiles::build(ImFontAtlas& atlas, float scale) {
  constexpr float kSmall = 15, kBody = 18, kTitle = 22, kDisplay = 34;
  atlas.Clear();
  Fonts fonts;
  fonts.body = add(atlas, kRegular, kBody * scale);  // first: ImGui's default
  fonts.small = add(atlas, kRegular, kSmall * scale);
  fonts.title = add(atlas, kBold, kTitle * scale);
  fonts.display = add(atlas, kBold, kDisplay * scale);
  fonts.body_bold = add(atlas, kBold, kBody * scale);
  fonts.mono_small = add(atlas, kMono, kSmall * scale);
  fonts.mono = add(atlas, kMono, kBody * scale);
  fonts.mono_title = add(atlas, kMono, kTitle * scale);
  fonts.mono_display = add(atlas, kMono, kDisplay * scale);
  if (!atlas.Build()) throw InputError("fonts of fonts-b612 cannot be drawn: install it again");
  for (ImFont* font : {fonts.mono_small, fonts.mono, fonts.mono_title, fonts.mono_display}) narrow_point(*font);
  return fonts;
}

}  // namespace knuckle::console::widgets
