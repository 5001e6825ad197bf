// A camera: a GStreamer pipeline of which only the newest picture is kept. What GStreamer says, connecting and connecting
// again are in a thread of its own; the owner never waits but in the destructor.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "video/frame.h"
#include "video/source.h"

namespace knuckle::video {

/// What became of the connection last; plain data.
struct CameraStatus {
  bool playing = false;         ///< Pictures come, or are to be expected.
  std::uint32_t troubles = 0;   ///< Counts problems up.
  std::array<char, 400> why{};  ///< The last problem, one line with what to do; empty before the first.
};

class Camera {
 public:
  /// Begins to connect. @param source checked before.
  explicit Camera(const CameraSource& source);
  /// Waits until GStreamer has let go of the source.
  ~Camera();
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  /// The newest picture, once; nullptr where there is no newer one than was taken. One thread only, as status().
  [[nodiscard]] std::unique_ptr<Frame> take() noexcept;
  [[nodiscard]] const CameraStatus& status() noexcept;

 private:
  class Runner;
  std::unique_ptr<Runner> runner_;
  CameraStatus status_;
};

}  // namespace knuckle::video
