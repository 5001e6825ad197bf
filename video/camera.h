// A camera: a GStreamer pipeline of which only the newest picture is kept. What GStreamer says, connecting and
// connecting again are in a thread of its own; the owner never waits but in the destructor.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "video/frame.h"
#include "video/sealing.h"
#include "video/source.h"

namespace knuckle::video {

class Camera {
 public:
  /// Begins to connect. @param source checked before. @param on_picture called for each, in a thread of GStreamer's.
  explicit Camera(const CameraSource& source, std::function<void()> on_picture = {}, const Patience& patience = {});
  /// Waits until GStreamer has let go of the source.
  ~Camera();
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  /// The newest picture, once; nullptr where there is no newer one than was taken. One thread only, as status().
  [[nodiscard]] std::unique_ptr<Frame> take() noexcept;
  [[nodiscard]] const CameraStatus& status() noexcept;
  /// Any thread: what its pictures are sealed with from now on, where the source is sealed.
  void set_key(const PictureKey& key);

 private:
  class Reader;
  std::unique_ptr<Reader> reader_;
  CameraStatus status_;
};

}  // namespace knuckle::video
