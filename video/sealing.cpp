#include "video/sealing.h"

#include <gst/rtp/rtp.h>

#include <algorithm>
#include <array>
#include <memory>
#include <random>
#include <utility>

#include "video/frame.h"

namespace knuckle::video {
namespace {

constexpr std::uint64_t kMostStreamsAhead = 1024;  // that a sender may have begun unheard; bounds what forged ones cost
constexpr Duration kChange = 2s;                   // within it both ends have the new key
constexpr int kMarkShift = 16;
constexpr std::uint16_t kLastStream = 0xFFFF;

Owned<GstBuffer> buffer_of(const PictureKey& key) {
  return Owned<GstBuffer>(gst_buffer_new_memdup(key.data(), key.size()));
}

/// A hint which key it is, that says nothing of it.
std::uint16_t mark_of(const PictureKey& key) {
  const std::unique_ptr<GChecksum, void (*)(GChecksum*)> sum(g_checksum_new(G_CHECKSUM_SHA256), g_checksum_free);
  g_checksum_update(sum.get(), key.data(), static_cast<gssize>(key.size()));
  std::array<guint8, 32> digest;
  gsize size = digest.size();
  g_checksum_get_digest(sum.get(), digest.data(), &size);
  return static_cast<std::uint16_t>(digest[0] << 8 | digest[1]);
}

PictureKey unknown_key() {
  std::random_device random;
  PictureKey key;
  for (std::uint8_t& byte : key) byte = static_cast<std::uint8_t>(random());
  return key;
}

void probe(GstElement* element, const char* pad_name, GstPadProbeType type, GstPadProbeCallback call, gpointer self) {
  const Owned<GstPad> pad(gst_element_get_static_pad(element, pad_name));
  gst_pad_add_probe(pad.get(), type, call, self, nullptr);
}

}  // namespace

void Sealer::set_key(const std::optional<PictureKey>& key) {
  const std::lock_guard lock(mutex_);
  given_ = key;
  untaken_ = true;
}

void Sealer::begin(GstElement* pipeline) {
  const Owned<GstElement> sealer(gst_bin_get_by_name(GST_BIN(pipeline), "sealer"));
  if (!sealer) return;
  element_ = sealer.get();  // lives as long as what streams through it
  anew_ = true;
  // GStreamer's element does not begin without one; nothing is sealed with what nobody knows.
  g_object_set(element_, "key", buffer_of(key_.value_or(unknown_key())).get(), nullptr);
  constexpr int kPackets = GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_BUFFER_LIST;
  const Owned<GstElement> payloader(gst_bin_get_by_name(GST_BIN(pipeline), "payloader"));
  probe(payloader.get(), "src", static_cast<GstPadProbeType>(kPackets), &Sealer::on_packets, this);
}

/// Before the packet that it seals first: no other one may go out with that stream's number.
void Sealer::take_key() {
  const std::lock_guard lock(mutex_);
  if (!std::exchange(untaken_, false)) return;
  open_ = given_.has_value();
  anew_ = true;
  if (!given_ || given_ == key_) return;
  key_ = *given_;
  mark_ = mark_of(*key_);
  stream_ = first_;
  g_object_set(element_, "key", buffer_of(*key_).get(), nullptr);
}

/// @return false where it must not be sent: no stream of this key is left.
bool Sealer::number(GstBuffer* packet) {
  GstRTPBuffer rtp = GST_RTP_BUFFER_INIT;
  if (gst_rtp_buffer_map(packet, GST_MAP_READWRITE, &rtp) == FALSE) return false;
  const std::uint16_t sequence = gst_rtp_buffer_get_seq(&rtp);
  const bool next = anew_ || sequence < sequence_;
  if (next && stream_ == kLastStream) open_ = false;
  if (next && open_) ++stream_;
  anew_ = false;
  sequence_ = sequence;
  gst_rtp_buffer_set_ssrc(&rtp, static_cast<guint32>(mark_) << kMarkShift | stream_);
  gst_rtp_buffer_unmap(&rtp);
  return open_;
}

GstPadProbeReturn Sealer::on_packets(GstPad* /*pad*/, GstPadProbeInfo* info, gpointer self) {
  auto* sealer = static_cast<Sealer*>(self);
  sealer->take_key();
  if (!sealer->open_) return GST_PAD_PROBE_DROP;
  if ((GST_PAD_PROBE_INFO_TYPE(info) & GST_PAD_PROBE_TYPE_BUFFER) != 0) {
    GstBuffer* packet = gst_buffer_make_writable(GST_PAD_PROBE_INFO_BUFFER(info));
    GST_PAD_PROBE_INFO_DATA(info) = packet;
    return sealer->number(packet) ? GST_PAD_PROBE_OK : GST_PAD_PROBE_DROP;
  }
  GstBufferList* packets = gst_buffer_list_make_writable(GST_PAD_PROBE_INFO_BUFFER_LIST(info));
  GST_PAD_PROBE_INFO_DATA(info) = packets;
  for (guint i = 0; i < gst_buffer_list_length(packets); ++i)
    if (!sealer->number(gst_buffer_list_get_writable(packets, i))) return GST_PAD_PROBE_DROP;
  return GST_PAD_PROBE_OK;
}

void Opener::set_key(const PictureKey& key) {
  const std::lock_guard lock(mutex_);
  if (current_ && current_->key == key) return;
  previous_ = current_;
  current_ = Known{key, mark_of(key), 0, 0};
  younger_ = older_ = 0;
  changed_at_ = aged_at_ = now();
}

void Opener::begin(GstElement* pipeline) {
  const Owned<GstElement> opener(gst_bin_get_by_name(GST_BIN(pipeline), "opener"));
  const std::lock_guard lock(mutex_);
  element_ = opener.get();
  if (!opener) return;
  under_way_ = 0;
  forget_streams();
  g_signal_connect(element_, "request-key", G_CALLBACK(&Opener::on_request), this);
  probe(element_, "rtp_sink", GST_PAD_PROBE_TYPE_BUFFER, &Opener::on_arrival, this);
  probe(element_, "rtp_src", GST_PAD_PROBE_TYPE_BUFFER, &Opener::on_opened, this);
}

/// With them GStreamer forgets what has come before: from now on only what is newer passes.
void Opener::forget_streams() {
  for (std::optional<Known>* one : {&current_, &previous_})
    if (*one) (*one)->floor = (*one)->newest;
}

/// The key before is not needed any more, once the change is over.
void Opener::tend() {
  {
    const std::lock_guard lock(mutex_);
    count(now());
    if (element_ == nullptr || !previous_ || changing(now())) return;
    previous_.reset();
    forget_streams();
  }
  g_signal_emit_by_name(element_, "clear-keys");
  const std::lock_guard lock(mutex_);
  forget_streams();  // what passed meanwhile is forgotten by GStreamer, too
}

/// What was refused counts once a while has passed without another key: a change may have reached the sender first.
void Opener::count(Time now) {
  if (now - aged_at_ < kChange) return;
  aged_at_ = now;
  refused_.fetch_add(std::exchange(older_, std::exchange(younger_, 0)), std::memory_order_relaxed);
}

bool Opener::changing(Time now) const {
  return changed_at_ != kNever && now - changed_at_ < kChange;
}

/// One that has arrived and did not pass, by the time that the next one arrives.
void Opener::settle(Time now) {
  if (std::exchange(under_way_, 0) == 0) return;
  if (current_ && !changing(now)) ++younger_;
}

std::string Opener::advice() const {
  const std::lock_guard lock(mutex_);
  if (element_ == nullptr) return {};
  if (!current_) return "the link: pictures are sealed with its session's key, and there is no session yet";
  if (refused() == 0) return {};
  return "the camera's name, which must be the one it has on the machine's side, and who sends there: " +
         std::to_string(refused()) + " packets came that this session's key does not open, or that had come before";
}

Opener::Known* Opener::known(std::uint32_t ssrc) {
  for (std::optional<Known>* one : {&current_, &previous_})
    if (*one && (*one)->mark == ssrc >> kMarkShift) return &**one;
  return nullptr;
}

GstPadProbeReturn Opener::on_arrival(GstPad* /*pad*/, GstPadProbeInfo* /*info*/, gpointer self) {
  auto* opener = static_cast<Opener*>(self);
  const std::lock_guard lock(opener->mutex_);
  opener->settle(now());
  opener->under_way_ = 1;
  return GST_PAD_PROBE_OK;
}

/// What gets here is authentic.
GstPadProbeReturn Opener::on_opened(GstPad* /*pad*/, GstPadProbeInfo* info, gpointer self) {
  GstRTPBuffer rtp = GST_RTP_BUFFER_INIT;
  if (gst_rtp_buffer_map(GST_PAD_PROBE_INFO_BUFFER(info), GST_MAP_READ, &rtp) == FALSE) return GST_PAD_PROBE_DROP;
  const bool passes = static_cast<Opener*>(self)->is_new(gst_rtp_buffer_get_ssrc(&rtp), gst_rtp_buffer_get_seq(&rtp));
  gst_rtp_buffer_unmap(&rtp);
  return passes ? GST_PAD_PROBE_OK : GST_PAD_PROBE_DROP;
}

bool Opener::is_new(std::uint32_t ssrc, std::uint16_t sequence) {
  const std::lock_guard lock(mutex_);
  Known* sealed_with = known(ssrc);
  if (sealed_with == nullptr) return false;
  const std::uint64_t number = (std::uint64_t{ssrc} & 0xFFFF) << 16 | sequence;
  if (number <= sealed_with->floor) return false;
  sealed_with->newest = std::max(sealed_with->newest, number);
  under_way_ = 0;
  return true;
}

/// What a stream opens with; nullptr where it can be none of the sender's.
GstCaps* Opener::on_request(GstElement* /*element*/, guint ssrc, gpointer self) {
  auto* opener = static_cast<Opener*>(self);
  const std::lock_guard lock(opener->mutex_);
  const Known* wanted = opener->known(ssrc);
  if (wanted == nullptr) return nullptr;
  const std::uint64_t stream = ssrc & 0xFFFF, newest = wanted->newest >> 16;
  if (stream + 1 < newest || stream > newest + kMostStreamsAhead) return nullptr;
  return gst_caps_new_simple("application/x-srtp", "srtp-key", GST_TYPE_BUFFER, buffer_of(wanted->key).get(),
                             "srtp-cipher", G_TYPE_STRING, "aes-128-gcm", "srtp-auth", G_TYPE_STRING, "null",
                             "srtcp-cipher", G_TYPE_STRING, "aes-128-gcm", "srtcp-auth", G_TYPE_STRING, "null",
                             nullptr);
}

}  // namespace knuckle::video
