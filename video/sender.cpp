#include "video/sender.h"

#include <gst/rtp/rtp.h>

#include <algorithm>
#include <chrono>

#include "video/frame.h"
#include "video/gst_owned.h"
#include "video/pipeline_runner.h"

namespace knuckle::video {
namespace {

constexpr int kAf41 = 34;
constexpr int kPacket_bytes = 1200;       // with all headers, and room for a tunnel's
constexpr int kPicturesPerKeyPicture = 30;  // after a loss, the next key picture mends it
constexpr int kJitterBuffer_ms = 30;
constexpr guint kStampId = 1;
constexpr std::uint64_t kUnixInNtp_s = 2'208'988'800;  // 1970 by NTP's count
constexpr const char* kStampUri = "urn:ietf:params:rtp-hdrext:ntp-64";  // RFC 6051, 64 bits

std::uint64_t ntp_now_ns() {
  const auto unix_time = std::chrono::system_clock::now().time_since_epoch();
  return kUnixInNtp_s * GST_SECOND +
         static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(unix_time).count());
}

/// When the picture in this buffer was captured, on NTP's time scale; by the pipeline's clock where that is not known.
std::uint64_t captured_ntp_ns(GstPad* pad, GstBuffer* buffer, GstElement* pipeline) {
  GstEvent* event = gst_pad_get_sticky_event(pad, GST_EVENT_SEGMENT, 0);
  if (event == nullptr) return ntp_now_ns();
  const GstSegment* segment = nullptr;
  gst_event_parse_segment(event, &segment);
  const GstClockTime running = gst_segment_to_running_time(segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
  gst_event_unref(event);
  if (!GST_CLOCK_TIME_IS_VALID(running)) return ntp_now_ns();
  const Time captured(Duration(static_cast<std::int64_t>(gst_element_get_base_time(pipeline) + running)));
  return ntp_now_ns() - static_cast<std::uint64_t>((now() - captured).count());
}

}  // namespace

std::string pipeline_of(const SenderSetup& setup) {
  return pictures_of(setup.camera) +
         " ! videoconvert ! video/x-raw,format=I420 ! queue max-size-buffers=1 leaky=downstream"
         " ! x264enc name=encoder tune=zerolatency speed-preset=superfast bitrate=" +
         std::to_string(setup.rate_kbps) + " key-int-max=" + std::to_string(kPicturesPerKeyPicture) +
         " ! video/x-h264,profile=main ! rtph264pay name=payloader config-interval=-1 aggregate-mode=zero-latency mtu=" +
         std::to_string(kPacket_bytes) + " ! udpsink sync=false async=false host=" + setup.host +
         " port=" + std::to_string(setup.port) + " qos-dscp=" + std::to_string(kAf41);
}

std::string receiver_of(std::uint16_t port, const std::string& address) {
  return "udpsrc address=" + address + " port=" + std::to_string(port) +
         " caps=\"application/x-rtp,media=video,clock-rate=90000,encoding-name=H264,payload=96,extmap-" +
         std::to_string(kStampId) + "=" + kStampUri + "\" ! rtpjitterbuffer faststart-min-packets=1 drop-on-latency=true latency=" +
         std::to_string(kJitterBuffer_ms) + " ! rtph264depay ! avdec_h264 max-threads=1";  // more threads hold pictures back
}

void check_sender(const SenderSetup& setup) {
  check_pipeline(setup.camera, pipeline_of(setup));
}

class Sender::Writer {
 public:
  explicit Writer(const SenderSetup& setup) : rate_kbps_(setup.rate_kbps), runner_(plan_of(setup)) {}
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  void set_rate(int kbps) noexcept { rate_kbps_.store(kbps, std::memory_order_relaxed); }
  bool take(CameraStatus& status) noexcept { return runner_.take(status); }
  [[nodiscard]] std::uint64_t pictures() const noexcept { return runner_.counted(); }

 private:
  [[nodiscard]] PipelinePlan plan_of(const SenderSetup& setup);
  void prepare(GstElement* pipeline);
  void tend(GstElement* pipeline);
  static GstPadProbeReturn on_picture(GstPad* pad, GstPadProbeInfo* info, gpointer self);

  std::atomic<int> rate_kbps_;
  int set_kbps_ = 0;                // in the encoder that runs
  GstElement* pipeline_ = nullptr;  // the one that runs
  PipelineRunner runner_;           // last: what it calls is there for longer
};

PipelinePlan Sender::Writer::plan_of(const SenderSetup& setup) {
  return {.name = "camera " + setup.camera.name,
          .description = pipeline_of(setup),
          .check = "the camera",
          .prepare = [this](GstElement* pipeline) { prepare(pipeline); },
          .ready = {},
          .tend = [this](GstElement* pipeline) { tend(pipeline); }};
}

void Sender::Writer::prepare(GstElement* pipeline) {
  pipeline_ = pipeline;
  set_kbps_ = 0;
  tend(pipeline);
  const Owned<GstElement> payloader(gst_bin_get_by_name(GST_BIN(pipeline), "payloader"));
  GstRTPHeaderExtension* stamp = gst_rtp_header_extension_create_from_uri(kStampUri);
  gst_rtp_header_extension_set_id(stamp, kStampId);
  g_object_set(stamp, "every-packet", TRUE, nullptr);  // the receiver looks at one of a picture's packets, not the first
  g_signal_emit_by_name(payloader.get(), "add-extension", stamp);
  gst_object_unref(stamp);
  const Owned<GstPad> pad(gst_element_get_static_pad(payloader.get(), "sink"));
  gst_pad_add_probe(pad.get(), GST_PAD_PROBE_TYPE_BUFFER, &Writer::on_picture, this, nullptr);
}

void Sender::Writer::tend(GstElement* pipeline) {
  const int wanted = rate_kbps_.load(std::memory_order_relaxed);
  if (wanted == set_kbps_) return;
  const Owned<GstElement> encoder(gst_bin_get_by_name(GST_BIN(pipeline), "encoder"));
  g_object_set(encoder.get(), "bitrate", static_cast<guint>(wanted), nullptr);
  set_kbps_ = wanted;
}

/// The payloader writes what is noted here into the packets' header.
GstPadProbeReturn Sender::Writer::on_picture(GstPad* pad, GstPadProbeInfo* info, gpointer self) {
  auto* writer = static_cast<Writer*>(self);
  GstBuffer* buffer = gst_buffer_make_writable(GST_PAD_PROBE_INFO_BUFFER(info));
  GST_PAD_PROBE_INFO_DATA(info) = buffer;
  GstCaps* scale = gst_caps_new_empty_simple("timestamp/x-ntp");
  gst_buffer_add_reference_timestamp_meta(buffer, scale, captured_ntp_ns(pad, buffer, writer->pipeline_),
                                          GST_CLOCK_TIME_NONE);
  gst_caps_unref(scale);
  writer->runner_.count();
  return GST_PAD_PROBE_OK;
}

Sender::Sender(const SenderSetup& setup) : writer_(std::make_unique<Writer>(setup)) {}
Sender::~Sender() = default;

void Sender::set_rate(int kbps) noexcept {
  writer_->set_rate(std::clamp(kbps, kLeastRate_kbps, kMostRate_kbps));
}

const CameraStatus& Sender::status() noexcept {
  writer_->take(status_);
  return status_;
}

std::uint64_t Sender::pictures() const noexcept {
  return writer_->pictures();
}

}  // namespace knuckle::video
