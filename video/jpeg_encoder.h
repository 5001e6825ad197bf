// Pictures of a camera as JPEG files, made by GStreamer in a thread of its own: one at a time, none waits.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "video/frame.h"

namespace knuckle::video {

/// One thread. Nothing waits but the constructor and the destructor.
class JpegEncoder {
 public:
  /// @throws InputError where GStreamer or its JPEG encoder is missing.
  JpegEncoder();
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  /// False while the picture given last is being made: then nothing may be given.
  [[nodiscard]] bool free() const noexcept { return !busy_; }
  void give(const Frame& frame);
  /// The picture given last, once, as soon as it is made; empty until then.
  [[nodiscard]] std::vector<std::uint8_t> take();
  /// Why nothing is made any more, once; empty: it works, or it has been told.
  [[nodiscard]] std::string problem();

 private:
  class Pipeline;
  std::unique_ptr<Pipeline> pipeline_;
  bool busy_ = false;
};

}  // namespace knuckle::video
