// What arrives of a camera over RTP, before it is decoded: of which codec it is, and whether something is missing in
// it. For the sources of this folder alone.
#pragma once

#include <gst/gst.h>

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/time.h"

namespace knuckle::video {

/// The codec of an RTP packet that is not H.264 as RFC 6184 packs it; nullptr: it may be that.
/// @param payload_type below 35 one of RFC 3551's, each of one codec.
[[nodiscard]] const char* other_codec(int payload_type, std::span<const std::uint8_t> payload) noexcept;

/// Whether a payload of H.264 begins a key picture, which is made from no other one: it has a sequence parameter set.
[[nodiscard]] bool begins_key_picture(std::span<const std::uint8_t> payload) noexcept;

class RtpWatch {
 public:
  /// A pipeline that is to run; one without a jitter buffer named "arrivals" is left alone.
  void begin(GstElement* pipeline);
  /// Often, in any one thread. @return the codec that comes there instead of H.264, and has for two seconds; nullptr:
  /// none does.
  [[nodiscard]] const char* wrong_codec(Time now);
  /// In the thread that streams: a packet of the newest picture, or of one that it is made from, was lost.
  [[nodiscard]] bool damaged() const noexcept { return damaged_; }

 private:
  static GstPadProbeReturn on_arrival(GstPad* pad, GstPadProbeInfo* info, gpointer self);
  static GstPadProbeReturn on_order(GstPad* pad, GstPadProbeInfo* info, gpointer self);
  void follow(std::uint16_t sequence, std::span<const std::uint8_t> payload) noexcept;

  std::atomic<std::uint64_t> h264_{0}, other_{0};  // packets
  std::atomic<const char*> codec_{nullptr};        // of the last other one
  Time looked_at_ = kNever;                        // since then:
  std::uint64_t h264_before_ = 0, other_before_ = 0;
  std::optional<std::uint16_t> sequence_;  // of the last packet, in order
  bool damaged_ = false;
};

}  // namespace knuckle::video
