#include "video/camera.h"

#include <gst/app/gstappsink.h>
#include <gst/video/video.h>

#include <chrono>
#include <utility>

#include "video/gst_owned.h"
#include "video/newest.h"
#include "video/pipeline_runner.h"
#include "video/rtp_watch.h"
#include "video/sealing.h"

namespace knuckle::video {
namespace {

Time time_of(GstClockTime ns) noexcept {
  return Time(Duration(static_cast<std::int64_t>(ns)));
}

/// A sample's picture, mapped for as long as it is owned.
struct Mapped {
  Owned<GstSample> sample;
  GstVideoFrame picture{};
  ~Mapped() {
    if (picture.buffer != nullptr) gst_video_frame_unmap(&picture);
  }
};

std::shared_ptr<const Mapped> map(Owned<GstSample> sample) {
  GstVideoInfo info;
  if (!sample || gst_video_info_from_caps(&info, gst_sample_get_caps(sample.get())) == FALSE) return nullptr;
  auto mapped = std::make_shared<Mapped>();
  if (gst_video_frame_map(&mapped->picture, &info, gst_sample_get_buffer(sample.get()), GST_MAP_READ) == FALSE)
    return nullptr;
  mapped->sample = std::move(sample);
  return mapped;
}

/// Where a sender's stamps come with the buffer, these; else when the buffer was captured, or arrived, here.
void stamp(Frame& frame, GstElement* pipeline, GstSample* sample) {
  frame.received = frame.captured = now();
  GstBuffer* buffer = gst_sample_get_buffer(sample);
  if (const auto* meta = gst_buffer_get_reference_timestamp_meta(buffer, nullptr)) {
    frame.stamp_from = StampFrom::kSender;
    frame.captured = time_of(meta->timestamp);
    return;
  }
  const GstSegment* segment = gst_sample_get_segment(sample);
  if (segment->format != GST_FORMAT_TIME || !GST_BUFFER_PTS_IS_VALID(buffer)) return;
  const GstClockTime running = gst_segment_to_running_time(segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
  if (GST_CLOCK_TIME_IS_VALID(running)) frame.captured = time_of(gst_element_get_base_time(pipeline) + running);
}

/// A source that is not live, such as a file, plays at its own pace; a live one sets the pace itself, and nothing
/// waits.
void set_pace(GstElement* pipeline) {
  const Owned<GstElement> sink(gst_bin_get_by_name(GST_BIN(pipeline), "pictures"));
  const Owned<GstPad> pad(gst_element_get_static_pad(sink.get(), "sink"));
  // Asked above the sink: one that waits for nothing calls every source not live.
  const Owned<GstQuery> query(gst_query_new_latency());
  gboolean live = TRUE;
  if (gst_pad_peer_query(pad.get(), query.get()) != FALSE)
    gst_query_parse_latency(query.get(), &live, nullptr, nullptr);
  g_object_set(sink.get(), "sync", live == FALSE, nullptr);
}

}  // namespace

Time now() noexcept {
  return Time(std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
}

class Camera::Reader {
 public:
  Reader(const CameraSource& source, std::function<void()> on_picture, const Patience& patience)
      : on_picture_(std::move(on_picture)), runner_(plan_of(source, patience)) {}
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  [[nodiscard]] std::unique_ptr<Frame> take() noexcept { return frames_.take(); }
  bool take(CameraStatus& status) noexcept { return runner_.take(status); }
  void set_key(const PictureKey& key) { opener_.set_key(key); }

 private:
  [[nodiscard]] PipelinePlan plan_of(const CameraSource& source, const Patience& patience);
  void prepare(GstElement* pipeline);
  [[nodiscard]] std::string problem();
  void take_sample(GstAppSink* sink);
  static GstFlowReturn on_sample(GstAppSink* sink, gpointer self);

  const std::function<void()> on_picture_;
  Newest<Frame> frames_;
  Opener opener_;
  RtpWatch arrivals_;
  GstElement* pipeline_ = nullptr;  // the one that runs
  PipelineRunner runner_;           // last: what it calls is there for longer
};

PipelinePlan Camera::Reader::plan_of(const CameraSource& source, const Patience& patience) {
  return {.name = "camera " + source.name,
          .description = pipeline_of(source),
          .check =
              [this] {
                const std::string advice = opener_.advice();
                return advice.empty() ? "the camera, its stream's codec and the network" : advice;
              },
          .prepare = [this](GstElement* pipeline) { prepare(pipeline); },
          .ready = &set_pace,
          .tend = [this](GstElement*) { opener_.tend(); },
          .problem = [this] { return problem(); },
          .refused = [this] { return opener_.refused(); },
          .patience = patience};
}

void Camera::Reader::prepare(GstElement* pipeline) {
  pipeline_ = pipeline;
  opener_.begin(pipeline);
  arrivals_.begin(pipeline);
  const Owned<GstElement> sink(gst_bin_get_by_name(GST_BIN(pipeline), "pictures"));
  GstAppSinkCallbacks calls{};
  calls.new_sample = &Reader::on_sample;
  gst_app_sink_set_callbacks(GST_APP_SINK(sink.get()), &calls, this, nullptr);
}

std::string Camera::Reader::problem() {
  const char* codec = arrivals_.wrong_codec(now());
  if (codec == nullptr) return {};
  return std::string("what is sent here is ") + codec + ", and must be H.264, as knuckle slave --camera sends it";
}

void Camera::Reader::take_sample(GstAppSink* sink) {
  Owned<GstSample> sample(gst_app_sink_try_pull_sample(sink, 0));
  if (!sample) return;
  auto frame = std::make_unique<Frame>();
  stamp(*frame, pipeline_, sample.get());
  const auto mapped = map(std::move(sample));
  if (!mapped) return;
  const GstVideoFrame& picture = mapped->picture;
  frame->width_px = GST_VIDEO_FRAME_WIDTH(&picture);
  frame->height_px = GST_VIDEO_FRAME_HEIGHT(&picture);
  frame->row_bytes = GST_VIDEO_FRAME_PLANE_STRIDE(&picture, 0);
  frame->pixels = static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&picture, 0));
  frame->memory = mapped;
  frame->connection = runner_.connection();
  frame->number = runner_.counted() + 1;
  frame->damaged = arrivals_.damaged();
  frames_.put(std::move(frame));
  runner_.count();
  if (on_picture_) on_picture_();
}

GstFlowReturn Camera::Reader::on_sample(GstAppSink* sink, gpointer self) {
  static_cast<Reader*>(self)->take_sample(sink);
  return GST_FLOW_OK;
}

Camera::Camera(const CameraSource& source, std::function<void()> on_picture, const Patience& patience)
    : reader_(std::make_unique<Reader>(source, std::move(on_picture), patience)) {}
Camera::~Camera() = default;

std::unique_ptr<Frame> Camera::take() noexcept {
  return reader_->take();
}

void Camera::set_key(const PictureKey& key) {
  reader_->set_key(key);
}

const CameraStatus& Camera::status() noexcept {
  reader_->take(status_);
  return status_;
}

}  // namespace knuckle::video
