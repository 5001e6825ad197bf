// A picture as a buffer of GStreamer's; for the sources of this folder alone.
#pragma once

#include <memory>

#include "video/frame.h"
#include "video/gst_owned.h"

namespace knuckle::video {

/// The picture where it lies, kept for as long as GStreamer looks at it.
[[nodiscard]] Owned<GstBuffer> wrapped(std::unique_ptr<Frame> frame);

}  // namespace knuckle::video
