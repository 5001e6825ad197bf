#include "video/camera.h"

#include <gst/app/gstappsink.h>
#include <gst/pbutils/missing-plugins.h>
#include <gst/video/video.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <optional>
#include <thread>

#include "core/mailbox.h"
#include "core/text.h"
#include "video/gst_owned.h"
#include "video/newest.h"

namespace knuckle::video {
namespace {

constexpr Duration kLook = 50ms;         // how often the thread looks up from waiting
constexpr Duration kFirstPicture = 10s;  // encoders, cameras and key frames take their time
constexpr Duration kNextPicture = 5s;    // a network source says nothing where nothing arrives
constexpr Duration kShortestWait = 500ms, kLongestWait = 4s;
constexpr guint kJitterBuffer_ms = 40;  // of an RTSP camera, where GStreamer's own 2 s would be useless

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

/// An error of GStreamer's as a person can act on it.
std::string advice(const GError& error, const char* details, const std::string& missing) {
  const std::string said = error.message;
  if (!missing.empty()) return "no " + missing + " on this computer: install the GStreamer plugin that has it";
  if (details != nullptr && std::strstr(details, "not-negotiated") != nullptr)
    return "the formats of the pipeline's elements do not fit: is the stream of the codec that it decodes?";
  if (error.domain == GST_RESOURCE_ERROR) return said + " Check that the camera is there, and the network";
  if (error.domain == GST_STREAM_ERROR) return said + " Check the stream's codec and the pipeline";
  return said;
}

}  // namespace

Time now() noexcept {
  return Time(std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
}

class Camera::Runner {
 public:
  explicit Runner(const CameraSource& source) : source_(source), thread_([this] { run(); }) {}
  ~Runner() {
    ending_ = true;
    thread_.join();
  }
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  Newest<Frame>& frames() noexcept { return frames_; }
  Mailbox<CameraStatus>& statuses() noexcept { return statuses_; }

 private:
  void run();
  /// Until it fails or is to end. @return what failed; nothing where it is to end.
  [[nodiscard]] std::optional<std::string> connect();
  [[nodiscard]] std::optional<std::string> watch(GstElement* pipeline, GstElement* sink);
  [[nodiscard]] std::optional<std::string> problem_of(GstMessage* message);
  void tell(bool playing, const std::string& why);
  void wait(Duration time);
  void take_sample(GstAppSink* sink);
  static GstFlowReturn on_sample(GstAppSink* sink, gpointer self);
  static void on_source(GstElement* reader, GstElement* source, gpointer self);

  const CameraSource source_;
  Newest<Frame> frames_;
  Mailbox<CameraStatus> statuses_;
  CameraStatus status_;
  std::atomic<bool> ending_{false};
  std::atomic<std::uint64_t> frames_so_far_{0};
  std::uint32_t connection_ = 0;  // changes while nothing streams
  GstElement* pipeline_ = nullptr;
  std::string missing_;
  std::thread thread_;
};

void Camera::Runner::run() {
  start_gstreamer();
  for (Duration pause = kShortestWait; !ending_;) {
    const std::uint64_t before = frames_so_far_;
    const std::optional<std::string> failed = connect();
    if (!failed) return;
    if (frames_so_far_ != before) pause = kShortestWait;
    tell(false, "camera " + source_.name + ": " + *failed + "; connecting again");
    wait(pause);
    pause = std::min(2 * pause, kLongestWait);
  }
}

std::optional<std::string> Camera::Runner::connect() {
  ++connection_;
  missing_.clear();
  std::string told;
  const Owned<GstElement> pipeline = make_pipeline(pipeline_of(source_), told);
  if (!pipeline) return told;
  pipeline_ = pipeline.get();
  // The system's clock, which is ours, whatever a source brings along.
  const Owned<GstClock> clock(gst_system_clock_obtain());
  gst_pipeline_use_clock(GST_PIPELINE(pipeline_), clock.get());
  const Owned<GstElement> sink(gst_bin_get_by_name(GST_BIN(pipeline_), "pictures"));
  GstAppSinkCallbacks calls{};
  calls.new_sample = &Runner::on_sample;
  gst_app_sink_set_callbacks(GST_APP_SINK(sink.get()), &calls, this, nullptr);
  const Owned<GstElement> reader(gst_bin_get_by_name(GST_BIN(pipeline_), "reader"));
  if (reader) g_signal_connect(reader.get(), "source-setup", G_CALLBACK(&Runner::on_source), nullptr);
  gst_element_set_state(pipeline_, GST_STATE_PLAYING);
  std::optional<std::string> failed = watch(pipeline_, sink.get());
  gst_element_set_state(pipeline_, GST_STATE_NULL);
  return failed;
}

std::optional<std::string> Camera::Runner::watch(GstElement* pipeline, GstElement* sink) {
  const Owned<GstBus> bus(gst_element_get_bus(pipeline));
  std::uint64_t seen = frames_so_far_;
  Time since = now();
  for (Duration patience = kFirstPicture; !ending_;) {
    const Owned<GstMessage> message(gst_bus_timed_pop(bus.get(), static_cast<GstClockTime>(kLook.count())));
    if (message && GST_MESSAGE_TYPE(message.get()) == GST_MESSAGE_ASYNC_DONE) {
      const Owned<GstQuery> query(gst_query_new_latency());
      gboolean live = TRUE;
      if (gst_element_query(pipeline, query.get()) != FALSE)
        gst_query_parse_latency(query.get(), &live, nullptr, nullptr);
      g_object_set(sink, "sync", live == FALSE, nullptr);
    } else if (message) {
      if (std::optional<std::string> problem = problem_of(message.get())) return problem;
    }
    if (seen != frames_so_far_) {
      if (patience == kFirstPicture) tell(true, {});
      patience = kNextPicture;
      seen = frames_so_far_;
      since = now();
    } else if (now() - since > patience) {
      return "no picture for " + std::to_string(patience / 1s) +
             " s: check the camera, its stream's codec and the network";
    }
  }
  return std::nullopt;
}

std::optional<std::string> Camera::Runner::problem_of(GstMessage* message) {
  if (gst_is_missing_plugin_message(message) != FALSE)
    missing_ = Owned<gchar>(gst_missing_plugin_message_get_description(message)).get();
  if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS) return "the stream has ended";
  if (GST_MESSAGE_TYPE(message) != GST_MESSAGE_ERROR) return std::nullopt;
  GError* said = nullptr;
  gchar* more = nullptr;
  gst_message_parse_error(message, &said, &more);
  const Owned<GError> error(said);
  const Owned<gchar> details(more);
  return advice(*error, details.get(), missing_);
}

void Camera::Runner::tell(bool playing, const std::string& why) {
  status_.playing = playing;
  if (!why.empty()) {
    ++status_.troubles;
    const std::string line = one_message(why);
    status_.why.fill(0);
    std::copy_n(line.begin(), std::min(line.size(), status_.why.size() - 1), status_.why.begin());
  }
  statuses_.put(status_);
}

void Camera::Runner::wait(Duration time) {
  for (const Time until = now() + time; now() < until && !ending_;) std::this_thread::sleep_for(kLook);
}

void Camera::Runner::take_sample(GstAppSink* sink) {
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
  frame->connection = connection_;
  frame->number = frames_so_far_ + 1;
  frames_.put(std::move(frame));
  ++frames_so_far_;
}

GstFlowReturn Camera::Runner::on_sample(GstAppSink* sink, gpointer self) {
  static_cast<Runner*>(self)->take_sample(sink);
  return GST_FLOW_OK;
}

/// An RTSP camera keeps its pictures back for as short as it may, and tells when they were captured.
void Camera::Runner::on_source(GstElement* /*reader*/, GstElement* source, gpointer /*self*/) {
  GObjectClass* kind = G_OBJECT_GET_CLASS(source);
  if (g_object_class_find_property(kind, "drop-on-latency") == nullptr) return;
  g_object_set(source, "latency", kJitterBuffer_ms, "drop-on-latency", TRUE, nullptr);
  if (g_object_class_find_property(kind, "add-reference-timestamp-meta") != nullptr)
    g_object_set(source, "add-reference-timestamp-meta", TRUE, nullptr);
}

Camera::Camera(const CameraSource& source) : runner_(std::make_unique<Runner>(source)) {}
Camera::~Camera() = default;

std::unique_ptr<Frame> Camera::take() noexcept {
  return runner_->frames().take();
}

const CameraStatus& Camera::status() noexcept {
  runner_->statuses().take(status_);
  return status_;
}

}  // namespace knuckle::video
