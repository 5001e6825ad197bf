// One picture of a camera.
#pragma once

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

}  // namespace knuckle::video
