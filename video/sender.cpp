#include "video/sender.h"

#include <fmt/format.h>
#include <gst/app/gstappsrc.h>
#include <gst/rtp/rtp.h>
#include <gst/video/video.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <utility>

#include "video/gst_owned.h"
#include "video/pipeline_runner.h"
#include "video/sealing.h"

namespace knuckle::video {
namespace {

constexpr int kAf41 = 34;
constexpr int kPacket_bytes = 1200;             // with all headers, and room for a tunnel's
constexpr int kPicturesPerKeyPicture = 30;      // after a loss, the next key picture mends it; ...
constexpr Duration kAskForKeyPicture = 1200ms;  // ... where pictures come slowly, once the last one is as old as this
constexpr int kJitterBuffer_ms = 30;
constexpr int kSocketBuffer_bytes = 1 << 20;  // a key picture's packets come all at once
constexpr guint kStampId = 1;
constexpr const char* kGiven = "given";                                 // the element that given pictures go into
constexpr std::uint64_t kUnixInNtp_s = 2'208'988'800;                   // 1970 by NTP's count
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

CameraSource given_pictures(const std::string& name, int width_px, int height_px) {
  return {name,
          fmt::format("appsrc name={} is-live=true format=time leaky-type=downstream max-buffers=1 max-bytes=0 "
                      "caps=\"video/x-raw,format=RGBx,framerate=30/1,width={},height={}\"",
                      kGiven, width_px, height_px),
          true};
}

std::string pipeline_of(const SenderSetup& setup) {
  const std::string encoded = fmt::format(
      "{} ! videoconvert ! video/x-raw,format=I420 ! queue max-size-buffers=1 leaky=downstream"
      " ! x264enc name=encoder tune=zerolatency speed-preset=superfast bitrate={} key-int-max={}"
      " ! video/x-h264,profile=main",
      pictures_of(setup.camera), setup.rate_kbps, kPicturesPerKeyPicture);
  return fmt::format(
      "{} ! rtph264pay name=payloader config-interval=-1 aggregate-mode=zero-latency mtu={}{}"
      " ! udpsink sync=false async=false host={} port={} qos-dscp={}",
      encoded, kPacket_bytes, setup.sealed ? fmt::format(" ! {}", kSealer) : "", setup.host, setup.port, kAf41);
}

std::string receiver_of(std::uint16_t port, const std::string& address, bool sealed) {
  const std::string arriving = fmt::format(
      "udpsrc address={} port={} buffer-size={} "
      "caps=\"application/x-{},media=video,clock-rate=90000,encoding-name=H264,payload=96,"
      "extmap-{}={}\"{}",
      address, port, kSocketBuffer_bytes, sealed ? "srtp" : "rtp", kStampId, kStampUri,
      sealed ? fmt::format(" ! {}", kOpener) : "");
  return fmt::format(
      "{} ! rtpjitterbuffer name=arrivals faststart-min-packets=1 drop-on-latency=true latency={} ! rtph264depay ! "
      "avdec_h264 "
      "max-threads=1",  // more threads hold pictures back
      arriving, kJitterBuffer_ms);
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
  void give(std::unique_ptr<Frame> frame);
  void set_key(const std::optional<PictureKey>& key) { sealer_.set_key(key); }
  bool take(CameraStatus& status) noexcept { return runner_.take(status); }
  [[nodiscard]] std::uint64_t pictures() const noexcept { return runner_.counted(); }

 private:
  [[nodiscard]] PipelinePlan plan_of(const SenderSetup& setup);
  void prepare(GstElement* pipeline);
  void tend(GstElement* pipeline);
  void ask_for_key_picture(GstPad* pad, GstBuffer* picture);
  static GstPadProbeReturn on_picture(GstPad* pad, GstPadProbeInfo* info, gpointer self);

  std::atomic<int> rate_kbps_;
  int set_kbps_ = 0;                // in the encoder that runs
  GstElement* pipeline_ = nullptr;  // the one that runs
  Time key_at_{};                   // its last key picture, ...
  bool key_asked_ = false;          // ... and whether the next one was asked for before its turn
  Sealer sealer_;
  std::mutex given_mutex_;   // of who gives and of the runner; neither is a loop
  Owned<GstElement> given_;  // where given pictures go, in the pipeline that runs
  PipelineRunner runner_;    // last: what it calls is there for longer
};

PipelinePlan Sender::Writer::plan_of(const SenderSetup& setup) {
  return {.name = "camera " + setup.camera.name,
          .description = pipeline_of(setup),
          .check = [] { return "the camera"; },
          .prepare = [this](GstElement* pipeline) { prepare(pipeline); },
          .ready = {},
          .tend = [this](GstElement* pipeline) { tend(pipeline); }};
}

void Sender::Writer::prepare(GstElement* pipeline) {
  pipeline_ = pipeline;
  set_kbps_ = 0;
  tend(pipeline);
  sealer_.begin(pipeline);
  {
    const std::lock_guard lock(given_mutex_);
    given_.reset(gst_bin_get_by_name(GST_BIN(pipeline), kGiven));
  }
  const Owned<GstElement> payloader(gst_bin_get_by_name(GST_BIN(pipeline), "payloader"));
  GstRTPHeaderExtension* stamp = gst_rtp_header_extension_create_from_uri(kStampUri);
  gst_rtp_header_extension_set_id(stamp, kStampId);
  g_object_set(stamp, "every-packet", TRUE,
               nullptr);  // the receiver looks at one of a picture's packets, not the first
  g_signal_emit_by_name(payloader.get(), "add-extension", stamp);
  gst_object_unref(stamp);
  const Owned<GstPad> pad(gst_element_get_static_pad(payloader.get(), "sink"));
  gst_pad_add_probe(pad.get(), GST_PAD_PROBE_TYPE_BUFFER, &Writer::on_picture, this, nullptr);
}

void Sender::Writer::give(std::unique_ptr<Frame> frame) {
  const std::lock_guard lock(given_mutex_);
  if (!given_) return;
  const GstClockTime begun = gst_element_get_base_time(given_.get());
  const auto captured = static_cast<GstClockTime>(frame->captured.time_since_epoch().count());
  if (begun == 0 || captured < begun) return;  // it did not run yet
  Owned<GstBuffer> buffer = wrapped(std::move(frame));
  GST_BUFFER_PTS(buffer.get()) = captured - begun;
  gst_app_src_push_buffer(GST_APP_SRC(given_.get()), buffer.release());
}

void Sender::Writer::tend(GstElement* pipeline) {
  const int wanted = rate_kbps_.load(std::memory_order_relaxed);
  if (wanted == set_kbps_) return;
  const Owned<GstElement> encoder(gst_bin_get_by_name(GST_BIN(pipeline), "encoder"));
  g_object_set(encoder.get(), "bitrate", static_cast<guint>(wanted), nullptr);
  set_kbps_ = wanted;
}

/// Who begins to look, or has lost a packet, waits for a key picture: not for long, however slowly pictures come.
void Sender::Writer::ask_for_key_picture(GstPad* pad, GstBuffer* picture) {
  const Time at = now();
  if (GST_BUFFER_FLAG_IS_SET(picture, GST_BUFFER_FLAG_DELTA_UNIT) == FALSE) {
    key_at_ = at;
    key_asked_ = false;
  } else if (!key_asked_ && at - key_at_ >= kAskForKeyPicture) {
    GstEvent* ask = gst_video_event_new_upstream_force_key_unit(GST_CLOCK_TIME_NONE, FALSE, 0);
    key_asked_ = gst_pad_push_event(pad, ask) != FALSE;
  }
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
  writer->ask_for_key_picture(pad, buffer);
  writer->runner_.count();
  return GST_PAD_PROBE_OK;
}

Sender::Sender(const SenderSetup& setup) : writer_(std::make_unique<Writer>(setup)) {}
Sender::~Sender() = default;

void Sender::give(std::unique_ptr<Frame> frame) {
  writer_->give(std::move(frame));
}

void Sender::set_key(const std::optional<PictureKey>& key) {
  writer_->set_key(key);
}

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
