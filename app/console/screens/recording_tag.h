// The light of the recording: in the banner, so on every screen.
#pragma once

#include <string>

#include "app/console/recording_light.h"
#include "app/console/widgets/widgets.h"

namespace knuckle::console::screens {

struct RecordingWords {
  std::string light;  ///< "REC 0:12:34", "NOT RECORDED", "REC STOPPED: why"
  std::string note;   ///< Behind it: "12.3 GB free, 7 steps lost"; may be empty.
};
/// @param elapsed_s of the recording.
[[nodiscard]] RecordingWords recording_words(const RecordingLight& light, double elapsed_s);

[[nodiscard]] float recording_width(const widgets::Ui& ui, const RecordingWords& words);
/// Ends with "..." where the area is too narrow.
void draw_recording(const widgets::Ui& ui, const RecordingLight& light, const RecordingWords& words,
                    const widgets::Area& area);

}  // namespace knuckle::console::screens
