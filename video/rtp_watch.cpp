#include "video/rtp_watch.h"

#include <gst/rtp/rtp.h>

#include <algorithm>
#include <array>

#include "video/gst_owned.h"

namespace knuckle::video {
namespace {

constexpr Duration kWatchEvery = 2s;
constexpr std::uint64_t kLeastPackets = 10;  // of another codec, in that time
constexpr std::uint64_t kMostlyOther = 9;    // for one packet that may be H.264, as some of any codec may

// Types of NAL units (RFC 6184, table 1).
constexpr unsigned kType = 0x1F, kParameterSet = 7, kAggregate = 24;
constexpr std::array<unsigned, 15> kTypes{1, 5, 6, 7, 8, 9, 10, 11, 12, 13, 19, kAggregate, 25, 28, 29};

/// RFC 7798: a header of two bytes, of which the second one is 1 where there is one layer, as nearly always.
bool is_h265(std::span<const std::uint8_t> payload) noexcept {
  if (payload.size() < 2 || (payload[0] & 0x81) != 0 || payload[1] != 1) return false;
  const unsigned type = payload[0] >> 1;
  return type <= 21 || (type >= 32 && type <= 40) || type == 48 || type == 49;
}

template <typename Look>
void look_at(GstPadProbeInfo* info, const Look& look) {
  GstRTPBuffer rtp = GST_RTP_BUFFER_INIT;
  if (gst_rtp_buffer_map(GST_PAD_PROBE_INFO_BUFFER(info), GST_MAP_READ, &rtp) == FALSE) return;
  look(rtp, std::span(static_cast<const std::uint8_t*>(gst_rtp_buffer_get_payload(&rtp)),
                      gst_rtp_buffer_get_payload_len(&rtp)));
  gst_rtp_buffer_unmap(&rtp);
}

}  // namespace

const char* other_codec(int payload_type, std::span<const std::uint8_t> payload) noexcept {
  switch (payload_type) {
    case 26:
      return "JPEG";
    case 31:
      return "H.261";
    case 32:
      return "MPEG-2";
    case 33:
      return "MPEG-TS";
    case 34:
      return "H.263";
    default:
      break;
  }
  if (payload.empty()) return nullptr;
  const bool h264 = payload[0] < 0x80 && std::count(kTypes.begin(), kTypes.end(), payload[0] & kType) > 0;
  if (h264 && payload_type > 34) return nullptr;
  return payload_type > 34 && is_h265(payload) ? "H.265" : "another codec";
}

bool begins_key_picture(std::span<const std::uint8_t> payload) noexcept {
  if (payload.empty()) return false;
  if ((payload[0] & kType) != kAggregate) return (payload[0] & kType) == kParameterSet;
  for (std::size_t at = 1; at + 2 < payload.size();) {  // each with its size before it
    if ((payload[at + 2] & kType) == kParameterSet) return true;
    at += 2 + static_cast<std::size_t>(payload[at] << 8 | payload[at + 1]);
  }
  return false;
}

void RtpWatch::begin(GstElement* pipeline) {
  const Owned<GstElement> buffer(gst_bin_get_by_name(GST_BIN(pipeline), "arrivals"));
  if (!buffer) return;
  looked_at_ = kNever;
  sequence_.reset();
  damaged_ = false;
  const Owned<GstPad> in(gst_element_get_static_pad(buffer.get(), "sink"));
  const Owned<GstPad> out(gst_element_get_static_pad(buffer.get(), "src"));
  gst_pad_add_probe(in.get(), GST_PAD_PROBE_TYPE_BUFFER, &RtpWatch::on_arrival, this, nullptr);
  gst_pad_add_probe(out.get(), GST_PAD_PROBE_TYPE_BUFFER, &RtpWatch::on_order, this, nullptr);
}

const char* RtpWatch::wrong_codec(Time now) {
  if (looked_at_ != kNever && now - looked_at_ < kWatchEvery) return nullptr;
  const std::uint64_t h264 = h264_ - h264_before_, other = other_ - other_before_;
  const bool first = looked_at_ == kNever;
  looked_at_ = now;
  h264_before_ += h264;
  other_before_ += other;
  return !first && other >= kLeastPackets && other > kMostlyOther * h264 ? codec_.load() : nullptr;
}

GstPadProbeReturn RtpWatch::on_arrival(GstPad* /*pad*/, GstPadProbeInfo* info, gpointer self) {
  auto* watch = static_cast<RtpWatch*>(self);
  look_at(info, [watch](GstRTPBuffer& rtp, std::span<const std::uint8_t> payload) {
    const char* codec = other_codec(gst_rtp_buffer_get_payload_type(&rtp), payload);
    if (codec != nullptr) watch->codec_ = codec;
    ++(codec == nullptr ? watch->h264_ : watch->other_);
  });
  return GST_PAD_PROBE_OK;
}

GstPadProbeReturn RtpWatch::on_order(GstPad* /*pad*/, GstPadProbeInfo* info, gpointer self) {
  auto* watch = static_cast<RtpWatch*>(self);
  look_at(info, [watch](GstRTPBuffer& rtp, std::span<const std::uint8_t> payload) {
    watch->follow(gst_rtp_buffer_get_seq(&rtp), payload);
  });
  return GST_PAD_PROBE_OK;
}

/// A sender that begins anew has other numbers; it begins with a key picture.
void RtpWatch::follow(std::uint16_t sequence, std::span<const std::uint8_t> payload) noexcept {
  if (sequence_ && sequence != static_cast<std::uint16_t>(*sequence_ + 1)) damaged_ = true;
  sequence_ = sequence;
  if (begins_key_picture(payload)) damaged_ = false;
}

}  // namespace knuckle::video
