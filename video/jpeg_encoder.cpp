#include "video/jpeg_encoder.h"

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>

#include <string>

#include "core/error.h"
#include "video/gst_owned.h"

namespace knuckle::video {
namespace {

constexpr const char* kPipeline =
    "appsrc name=in format=time ! videoconvert ! jpegenc quality=80 ! appsink name=out sync=false max-buffers=1";

}  // namespace

class JpegEncoder::Pipeline {
 public:
  Pipeline() {
    start_gstreamer();
    std::string told;
    pipeline_ = make_pipeline(kPipeline, told);
    if (!pipeline_) throw InputError("pictures cannot be recorded: " + told);
    in_.reset(gst_bin_get_by_name(GST_BIN(pipeline_.get()), "in"));
    out_.reset(gst_bin_get_by_name(GST_BIN(pipeline_.get()), "out"));
    gst_element_set_state(pipeline_.get(), GST_STATE_PLAYING);
  }
  ~Pipeline() { gst_element_set_state(pipeline_.get(), GST_STATE_NULL); }
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  void push(const Frame& frame) {
    if (frame.width_px != width_px_ || frame.height_px != height_px_) announce(frame);
    Owned<GstBuffer> buffer = wrapped(std::make_unique<Frame>(frame));
    GST_BUFFER_PTS(buffer.get()) = 0;
    gst_app_src_push_buffer(GST_APP_SRC(in_.get()), buffer.release());
  }
  [[nodiscard]] std::vector<std::uint8_t> pull() {
    const Owned<GstSample> sample(gst_app_sink_try_pull_sample(GST_APP_SINK(out_.get()), 0));
    if (!sample) return {};
    GstBuffer* const buffer = gst_sample_get_buffer(sample.get());
    std::vector<std::uint8_t> bytes(gst_buffer_get_size(buffer));
    gst_buffer_extract(buffer, 0, bytes.data(), bytes.size());
    return bytes;
  }

  [[nodiscard]] std::string problem() {
    const Owned<GstBus> bus(gst_element_get_bus(pipeline_.get()));
    const Owned<GstMessage> message(gst_bus_pop_filtered(bus.get(), GST_MESSAGE_ERROR));
    return message ? complaint(message.get()) : "";
  }

 private:
  void announce(const Frame& frame) {
    width_px_ = frame.width_px;
    height_px_ = frame.height_px;
    GstCaps* const caps =
        gst_caps_new_simple("video/x-raw", "format", G_TYPE_STRING, "RGBx", "width", G_TYPE_INT, width_px_, "height",
                            G_TYPE_INT, height_px_, "framerate", GST_TYPE_FRACTION, 0, 1, nullptr);
    gst_app_src_set_caps(GST_APP_SRC(in_.get()), caps);
    gst_caps_unref(caps);
  }

  Owned<GstElement> pipeline_, in_, out_;
  int width_px_ = 0, height_px_ = 0;
};

JpegEncoder::JpegEncoder() : pipeline_(std::make_unique<Pipeline>()) {}
JpegEncoder::~JpegEncoder() = default;

void JpegEncoder::give(const Frame& frame) {
  busy_ = true;
  pipeline_->push(frame);
}

std::string JpegEncoder::problem() {
  return pipeline_->problem();
}

std::vector<std::uint8_t> JpegEncoder::take() {
  if (!busy_) return {};
  std::vector<std::uint8_t> made = pipeline_->pull();
  busy_ = made.empty();
  return made;
}

}  // namespace knuckle::video
