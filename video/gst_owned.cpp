#include "video/gst_owned.h"

namespace knuckle::video {

Owned<GstBuffer> wrapped(std::unique_ptr<Frame> frame) {
  const auto size = static_cast<gsize>(frame->row_bytes) * static_cast<gsize>(frame->height_px);
  auto* pixels = const_cast<std::uint8_t*>(frame->pixels);  // the memory is marked as not to be written
  return Owned<GstBuffer>(gst_buffer_new_wrapped_full(GST_MEMORY_FLAG_READONLY, pixels, size, 0, size, frame.release(),
                                                      [](gpointer given) { delete static_cast<Frame*>(given); }));
}

}  // namespace knuckle::video
