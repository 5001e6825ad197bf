// Pictures of the cameras for the recording, as the operator saw them: so many a second, as JPEG.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/time.h"
#include "recording/camera_picture.h"
#include "video/frame.h"
#include "video/jpeg_encoder.h"

namespace knuckle::console {

/// For the window's thread.
class PictureLog {
 public:
  /// @param per_s of each camera, at most; 0: none. @throws InputError as video::JpegEncoder does.
  explicit PictureLog(double per_s);

  struct Made {
    std::uint32_t run = 0;  ///< The session it was shown in.
    recording::CameraPicture picture;
  };
  /// A picture that is shown now, which is one of the recorded where its turn has come. One of each session time: none
  /// while a session is paused.
  void show(std::uint32_t run, const recording::CameraStamp& stamp, const video::Frame& frame);
  /// Those made since the last call.
  [[nodiscard]] std::vector<Made> made();
  /// Of which camera nothing is recorded any more, and why, once each.
  [[nodiscard]] std::vector<std::string> problems();

 private:
  struct Camera {
    video::JpegEncoder encoder;
    Made next;  ///< Being made.
    Time last = kNever;
  };

  Duration period_;
  std::map<std::string, std::unique_ptr<Camera>> cameras_;
};

}  // namespace knuckle::console
