// Owners of what GStreamer counts references of; for the sources of this folder alone.
#pragma once

#include <gst/gst.h>

#include <memory>
#include <string>

#include "video/frame.h"

namespace knuckle::video {

struct Unref {
  void operator()(gpointer object) const { gst_object_unref(object); }
  void operator()(GstMessage* message) const { gst_message_unref(message); }
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
  void operator()(GstBuffer* buffer) const { gst_buffer_unref(buffer); }
  void operator()(GstQuery* query) const { gst_query_unref(query); }
  void operator()(GError* error) const { g_error_free(error); }
  void operator()(gchar* text) const { g_free(text); }
};
template <typename T>
using Owned = std::unique_ptr<T, Unref>;

/// Once for the process; takes a second where GStreamer's list of plugins is not up to date. @throws InputError.
void start_gstreamer();

/// The pipeline made of a description; not yet running. @param told what is wrong, in GStreamer's words, where nullptr
/// is returned.
[[nodiscard]] Owned<GstElement> make_pipeline(const std::string& description, std::string& told);

/// Of an error or a warning: what it says.
[[nodiscard]] std::string complaint(GstMessage* message);

// A picture as a buffer of GStreamer's; for the sources of this folder alone.

/// The picture where it lies, kept for as long as GStreamer looks at it.
[[nodiscard]] Owned<GstBuffer> wrapped(std::unique_ptr<Frame> frame);

}  // namespace knuckle::video
