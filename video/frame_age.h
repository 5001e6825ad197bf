// How old the picture on screen is, from the stamps of its frames: a picture that arrives, but late, is as bad as one
// that does not arrive.
#pragma once

#include <cstdint>

#include "core/time.h"
#include "video/frame.h"

namespace knuckle::video {

enum class VideoState : std::uint8_t {
  kNone,    ///< There was never a picture.
  kLive,    ///< What is shown is what is.
  kLate,    ///< Pictures come, but old ones.
  kFrozen,  ///< No picture comes.
};

/// What is older is not live. A frame of a display later the person sees it: within 0.3 s.
inline constexpr double kOldestLive_s = 0.25;

class FrameAge {
 public:
  /// The newest frame.
  void take(const Frame& frame) noexcept;
  /// Since the newest frame was captured. How a sender's clock stands to ours is not known: the quickest frame of a
  /// connection counts as one that took no time, so what every frame takes is not in it.
  [[nodiscard]] double age_s(Time now) const noexcept;
  [[nodiscard]] VideoState state(Time now) const noexcept;
  /// The age is one over that of the quickest frame.
  [[nodiscard]] bool relative() const noexcept { return stamp_from_ == StampFrom::kSender; }

 private:
  std::uint32_t connection_ = 0;  // 0: no frame yet
  Time captured_{}, received_{};  // of the newest, by our clock
  Duration least_transit_{};      // from a sender's stamp to arrival
  StampFrom stamp_from_ = StampFrom::kHere;
};

}  // namespace knuckle::video
