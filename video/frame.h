// One picture of a camera.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "core/time.h"

namespace knuckle::video {

/// The clock of all times in this folder: CLOCK_MONOTONIC, from its own zero on.
[[nodiscard]] Time now() noexcept;

enum class StampFrom : std::uint8_t {
  kHere,    ///< Time of capture by this computer's clock; of arrival, where a sender elsewhere gives no stamps.
  kSender,  ///< Time of capture by the sender's clock: only differences between its stamps mean anything.
};

struct Frame {
  int width_px = 0, height_px = 0, row_bytes = 0;
  const std::uint8_t* pixels = nullptr;  ///< Rows from above; four bytes a pixel: red, green, blue, and one unused.
  std::shared_ptr<const void> memory;    ///< Keeps the pixels.
  std::uint64_t number = 0;              ///< Counts the camera's frames up from 1.
  std::uint32_t connection = 0;          ///< Of the camera to its source; counts up from 1.
  bool damaged = false;  ///< A part of it, or of a picture that it is made from, was lost: parts of it may be old.
  StampFrom stamp_from = StampFrom::kHere;
  Time captured{};  ///< The stamp.
  Time received{};  ///< Ready to be shown.
};

/// So long without a picture is a failure.
struct Patience {
  Duration first = std::chrono::seconds(10);  ///< Encoders, cameras and key frames take their time.
  Duration next = std::chrono::seconds(5);    ///< A network source says nothing where nothing arrives.
};

// What became of a camera's connection last; plain data.

struct CameraStatus {
  bool playing = false;         ///< Pictures come.
  std::uint32_t troubles = 0;   ///< Counts problems up.
  std::uint64_t refused = 0;    ///< Packets that came and were not let in: not sealed with the key, or sent again.
  std::array<char, 400> why{};  ///< The last problem, one line with what to do; empty before the first.
};

// How old the picture on screen is, from the stamps of its frames: a picture that arrives, but late, is as bad as one
// that does not arrive.

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
