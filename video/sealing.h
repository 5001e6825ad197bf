// Pictures sealed on their way: SRTP with AES-128-GCM (RFC 3711, 7714) by GStreamer's elements, with keys from outside.
// For the sources of this folder alone.
//
// A stream's SSRC says which key seals it (16 bits made of the key) and counts up (16 bits) each time the sequence
// numbers wrap or the sender begins anew. So SRTP's rollover counter is always 0, whoever begins to receive late finds
// in, no nonce is ever used twice, and what was sent before can be told from what comes after, also by a receiver that
// has itself begun anew.
#pragma once

#include <gst/gst.h>

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "core/time.h"
#include "video/gst_owned.h"
#include "video/picture_key.h"

namespace knuckle::video {

/// Parts of a pipeline, as gst-launch-1.0 takes them.
inline constexpr const char* kSealer =
    "srtpenc name=sealer rtp-cipher=aes-128-gcm rtp-auth=null rtcp-cipher=aes-128-gcm rtcp-auth=null";
inline constexpr const char* kOpener = "srtpdec name=opener";

/// In a sender's pipeline: nothing passes before there is a key.
class Sealer {
 public:
  /// Any thread; from the next packet on.
  void set_key(const PictureKey& key);
  /// A pipeline that is to run, with its packets from an element named "payloader"; one without a sealer is left alone.
  void begin(GstElement* pipeline);

 private:
  static GstPadProbeReturn on_packets(GstPad* pad, GstPadProbeInfo* info, gpointer self);
  // In the thread that streams.
  void take_key();
  void number(GstBuffer* packet);

  std::mutex mutex_;
  std::optional<PictureKey> given_;  // and not yet taken

  GstElement* element_ = nullptr;
  std::optional<PictureKey> key_;
  bool anew_ = true;  // the next packet begins a stream
  std::uint16_t mark_ = 0, stream_ = 0, sequence_ = 0;
};

/// In a receiver's pipeline: what is not sealed with the newest key, or for a moment the one before, was changed on the
/// way or has come before does not pass.
class Opener {
 public:
  /// Any thread.
  void set_key(const PictureKey& key);
  /// A pipeline that is to run; one without an opener is left alone.
  void begin(GstElement* pipeline);
  /// Often, in any one thread, while it runs.
  void tend();
  /// Packets that did not pass; those of the moment in which both ends change keys are not counted.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_.load(std::memory_order_relaxed); }
  /// What to look at where no picture comes; empty: nothing is known here.
  [[nodiscard]] std::string advice() const;

 private:
  struct Known {
    PictureKey key{};
    std::uint16_t mark = 0;
    std::uint64_t newest = 0;  ///< Stream and sequence number of what passed.
    std::uint64_t floor = 0;   ///< Not passed again: what passed before streams were forgotten.
  };
  static GstPadProbeReturn on_arrival(GstPad* pad, GstPadProbeInfo* info, gpointer self);
  static GstPadProbeReturn on_opened(GstPad* pad, GstPadProbeInfo* info, gpointer self);
  static GstCaps* on_request(GstElement* element, guint ssrc, gpointer self);
  [[nodiscard]] bool is_new(std::uint32_t ssrc, std::uint16_t sequence);
  [[nodiscard]] Known* known(std::uint32_t ssrc);  // mutex_ is held, as in the next
  void settle(Time now);
  [[nodiscard]] bool changing(Time now) const;
  void forget_streams();

  mutable std::mutex mutex_;  // of threads that are not real-time
  std::optional<Known> current_, previous_;
  Time changed_at_ = kNever;
  GstElement* element_ = nullptr;  // of the pipeline that runs
  std::uint64_t under_way_ = 0;    // of the streaming thread: arrived, and neither passed nor counted
  std::atomic<std::uint64_t> refused_{0};
};

}  // namespace knuckle::video
