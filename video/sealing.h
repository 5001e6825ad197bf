// Pictures sealed on their way: SRTP with AES-128-GCM (RFC 3711, 7714) by GStreamer's elements, with keys from outside.
// For the sources of this folder alone.
//
// A stream's SSRC says which key seals it (16 bits made of the key) and counts up (16 bits) each time the sequence
// numbers wrap or the sender begins anew. So SRTP's rollover counter is always 0, whoever begins to receive late finds
// in, no nonce is used twice, and what was sent before can be told from what comes after, also by a receiver that has
// itself begun anew. A key whose 65 535 streams are used up seals nothing more: nothing is sent until the next key.
#pragma once

#include <gst/gst.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "core/time.h"
#include "video/gst_owned.h"

namespace knuckle::video {

// What pictures are sealed with on their way.

/// Master key (16 bytes) and salt (12) of SRTP with AES-128-GCM (RFC 7714).
using PictureKey = std::array<std::uint8_t, 28>;

/// Parts of a pipeline, as gst-launch-1.0 takes them.
inline constexpr const char* kSealer =
    "srtpenc name=sealer rtp-cipher=aes-128-gcm rtp-auth=null rtcp-cipher=aes-128-gcm rtcp-auth=null";
inline constexpr const char* kOpener = "srtpdec name=opener";

/// In a sender's pipeline: nothing passes without a key.
class Sealer {
 public:
  /// @param streams of each key that count as used already: for tests.
  explicit Sealer(std::uint16_t streams = 0) : first_(streams) {}
  /// Any thread; from the next packet on. nullopt: nothing passes any more.
  void set_key(const std::optional<PictureKey>& key);
  /// A pipeline that is to run, with its packets from an element named "payloader"; one without a sealer is left alone.
  void begin(GstElement* pipeline);

 private:
  static GstPadProbeReturn on_packets(GstPad* pad, GstPadProbeInfo* info, gpointer self);
  // In the thread that streams.
  void take_key();
  [[nodiscard]] bool number(GstBuffer* packet);

  std::mutex mutex_;
  std::optional<PictureKey> given_;
  bool untaken_ = false;

  const std::uint16_t first_;
  GstElement* element_ = nullptr;
  std::optional<PictureKey> key_;  // the last one: given again, it goes on where it was
  bool open_ = false;              // there is a key, and streams of it are left
  bool anew_ = true;               // the next packet begins a stream
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
  /// Packets that did not pass; counted two to four seconds later, and only where no change of keys explains them.
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
  void count(Time now);
  [[nodiscard]] bool changing(Time now) const;
  void forget_streams();

  mutable std::mutex mutex_;  // of threads that are not real-time
  std::optional<Known> current_, previous_;
  Time changed_at_ = kNever;
  GstElement* element_ = nullptr;          // of the pipeline that runs
  std::uint64_t under_way_ = 0;            // arrived, and neither passed nor refused
  std::uint64_t younger_ = 0, older_ = 0;  // refused, and not yet counted
  Time aged_at_{};                         // when the younger ones became the older ones
  std::atomic<std::uint64_t> refused_{0};
};

}  // namespace knuckle::video
