#include "recording/mcap/reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <ranges>
#include <utility>

#include "core/text.h"

namespace knuckle::mcap {
namespace {

/// By the Message Index records after it; 0 where there are none.
std::uint64_t messages_of(RecordFile& file, const Record& chunk) {
  std::uint64_t messages = 0;
  auto record = file.record_at(chunk.end());
  for (; record && record->opcode == Opcode::kMessageIndex; record = file.record_at(record->end())) {
    const auto bytes = file.content(*record, sizeof(std::uint16_t) + sizeof(std::uint32_t));
    if (!bytes) break;
    Decoder head(*bytes);
    (void)head.number<std::uint16_t>();
    constexpr std::uint32_t kEntry_bytes = 8 + 8;
    const auto entries = head.number<std::uint32_t>();
    if (entries <= record->content_bytes()) messages += entries / kEntry_bytes;
  }
  return messages;
}

}  // namespace

Reader::Reader(const std::string& path, std::span<const char* const> topics)
    : file_(path), topic_order_(topics.begin(), topics.end()), survey_(file_) {
  std::stable_sort(survey_.places.begin(), survey_.places.end(),
                   [](const MessagePlace& a, const MessagePlace& b) { return a.first_time_ns < b.first_time_ns; });
}

std::optional<Attachment> Reader::read(const AttachmentEntry& entry) {
  const auto record = file_.record_at(entry.record_at);
  if (!record) return {};
  const auto bytes = file_.content(*record);
  if (!bytes) return {};
  Decoder from(*bytes);
  Attachment attachment;
  attachment.log_time_ns = from.number<std::uint64_t>();
  attachment.create_time_ns = from.number<std::uint64_t>();
  attachment.name = from.text();
  attachment.media_type = from.text();
  const auto data = from.bytes(from.number<std::uint64_t>());
  const auto covered = bytes->first(bytes->size() - from.rest().size());
  const auto crc = from.number<std::uint32_t>();
  if (!from.ok() || (crc != 0 && crc != crc32(covered))) {
    file_.damaged(*record, "CRC does not match; left out");
    return {};
  }
  attachment.data.assign(data.begin(), data.end());
  return attachment;
}

void Reader::seek(std::uint64_t log_time_ns) {
  not_before_ns_ = log_time_ns;
  next_place_ = 0;
  forget_time();
  for (Open& chunk : open_) recycle(std::move(chunk));
  open_.clear();
  channels_seen_.clear();
  topics_seen_.clear();
  if (!counted_) backwards_ = twice_ = {};
}

std::optional<Message> Reader::next() {
  for (;;) {
    open_what_is_due();
    if (open_.empty()) {
      counted_ = true;
      return {};
    }
    std::pop_heap(open_.begin(), open_.end(), later);
    OpenChunk& chunk = *open_.back();
    const Place place = chunk.places[chunk.next++];
    if (!of_this_time_.empty() && of_this_time_.front().message.log_time_ns != place.log_time_ns) forget_time();
    auto message = message_at(chunk, place);
    if (message) {
      Seen& topic = seen_of(message->channel_id);
      if (!handed_out_before(*message, topic)) {
        hand_out(chunk, place, *message, topic);
      } else {
        if (!counted_) twice_.add(place.log_time_ns);
        message.reset();
      }
    }
    if (chunk.next < chunk.places.size()) {
      std::push_heap(open_.begin(), open_.end(), later);
    } else {
      done_.push_back(std::move(open_.back()));
      open_.pop_back();
    }
    if (message) return message;
  }
}

bool Reader::later(const Open& chunk, const Open& other) noexcept {
  const auto key = [](const OpenChunk& of) { return std::pair(of.places[of.next].order(), of.record.at); };
  return key(*chunk) > key(*other);
}

/// Opens all that may hold a message before the next one of those at hand.
void Reader::open_what_is_due() {
  constexpr std::uint64_t kMostOpen_bytes = 2 * kLargestRecord_bytes;
  for (; next_place_ < survey_.places.size(); ++next_place_) {
    const MessagePlace& place = survey_.places[next_place_];
    if (!open_.empty()) {
      const OpenChunk& first = *open_.front();
      if (first.places[first.next].log_time_ns < place.first_time_ns) return;
      std::uint64_t bytes = 0;
      for (const Open& chunk : open_) bytes += chunk->records.size();
      if (bytes > kMostOpen_bytes)
        return file_.damages.add(
            "chunk", place.at,
            fmt::format("overlaps in time with more than {} bytes of others: read late", kMostOpen_bytes));
    }
    open(place);
  }
}

void Reader::open(const MessagePlace& place) {
  if (place.last_time_ns < not_before_ns_) return;
  Open chunk = spare_.empty() ? std::make_unique<OpenChunk>() : std::move(spare_.back());
  if (!spare_.empty()) spare_.pop_back();
  const auto record = file_.record_at(place.at);
  if (!record) return;
  chunk->record = *record;
  bool read = false;
  if (record->opcode != Opcode::kChunk) {
    read = place.bytes <= kLargestRecord_bytes && file_.read(place.at, place.bytes, chunk->records);
    if (!read) file_.damaged(*record, "too large, or cannot be read; left out");
  } else if (const auto head = chunk_head(file_, *record)) {
    std::string why;
    read = unpack(*record, *head, chunk->records, why);
    if (!read) left_out(*record, *head, why);
  }
  if (read) find_messages(*chunk, place);
  if (!read || chunk->places.empty()) return recycle(std::move(chunk));
  open_.push_back(std::move(chunk));
  std::push_heap(open_.begin(), open_.end(), later);
}

bool Reader::unpack(const Record& record, const ChunkHead& head, Bytes& records, std::string& why) {
  if (const auto largest = std::max(record.bytes, head.uncompressed_bytes); largest > kLargestRecord_bytes) {
    why = fmt::format("{} bytes, at most {} are read", largest, kLargestRecord_bytes);
    return false;
  }
  const bool zstd = head.compression == "zstd", lz4 = head.compression == "lz4";
  if (!zstd && !lz4 && !head.compression.empty()) {
    why = fmt::format("compressed by '{}'; only zstd and lz4 are read", shortened(head.compression));
    return false;
  }
  if (!file_.read(head.records_at, head.records_bytes, zstd || lz4 ? packed_ : records)) {
    why = "cannot be read";
    return false;
  }
  const bool whole = zstd  ? zstd_.decompress(packed_, head.uncompressed_bytes, records)
                     : lz4 ? lz4_.decompress(packed_, head.uncompressed_bytes, records)
                           : records.size() == head.uncompressed_bytes;
  if (!whole) {
    why = fmt::format("does not decompress to {} bytes", head.uncompressed_bytes);
    return false;
  }
  if (head.crc != 0 && head.crc != crc32(records)) {
    why = "CRC does not match";
    return false;
  }
  return true;
}

/// Its schemas and channels become known; messages before the time that was sought are passed over.
void Reader::find_messages(OpenChunk& chunk, const MessagePlace& place) {
  chunk.places.clear();
  chunk.next = 0;
  Decoder from(chunk.records);
  while (!from.rest().empty()) {
    const auto opcode = from.number<Opcode>();
    const auto content = from.bytes(from.number<std::uint64_t>());
    if (!from.ok()) {
      file_.damaged(chunk.record, "its records do not fit into it; those after the last whole one left out");
      break;
    }
    if (opcode == Opcode::kSchema) survey_.add_schema(file_, Decoder(content), chunk.record);
    if (opcode == Opcode::kChannel) survey_.add_channel(file_, Decoder(content), chunk.record);
    if (opcode != Opcode::kMessage) continue;
    Decoder head(content);
    const auto channel_id = head.number<std::uint16_t>();
    const auto sequence = head.number<std::uint32_t>();
    const auto log_time_ns = head.number<std::uint64_t>();
    if (content.size() < kMessageHead_bytes) {
      file_.damaged(chunk.record, "a message is too short; left out");
      continue;
    }
    if (log_time_ns < place.first_time_ns || log_time_ns > place.last_time_ns)
      file_.damaged(chunk.record, "has messages from outside of the time that it says; their order may be wrong");
    if (log_time_ns >= not_before_ns_)
      chunk.places.push_back({log_time_ns, rank_of(channel_id), sequence,
                              static_cast<std::uint32_t>(content.data() - chunk.records.data()),
                              static_cast<std::uint32_t>(content.size())});
  }
  const auto earlier = [](const Place& a, const Place& b) { return a.order() < b.order(); };
  if (!std::is_sorted(chunk.places.begin(), chunk.places.end(), earlier))
    std::stable_sort(chunk.places.begin(), chunk.places.end(), earlier);
}

/// A channel stands once in a file, before its first message there: by time, others may come before it.
void Reader::describe_all() {
  if (std::exchange(described_, true)) return;
  OpenChunk chunk;
  for (const MessagePlace& place : survey_.places) {
    const auto record = file_.record_at(place.at);
    if (!record || record->opcode != Opcode::kChunk) continue;
    chunk.record = *record;
    const auto head = chunk_head(file_, *record);
    std::string why;
    if (head && unpack(*record, *head, chunk.records, why)) find_messages(chunk, place);
  }
}

std::optional<Message> Reader::message_at(const OpenChunk& chunk, const Place& place) {
  Decoder content(std::span<const std::uint8_t>(chunk.records).subspan(place.at, place.bytes));
  Message message;
  message.channel_id = content.number<std::uint16_t>();
  message.sequence = content.number<std::uint32_t>();
  message.log_time_ns = content.number<std::uint64_t>();
  message.publish_time_ns = content.number<std::uint64_t>();
  message.data = content.rest();
  if (survey_.topics.channels.contains(message.channel_id)) return message;
  file_.damaged(chunk.record, fmt::format("channel {} is not described; its messages left out", message.channel_id));
  return {};
}

std::uint32_t Reader::rank_of(std::uint16_t channel_id) {
  const auto known = ranks_.find(channel_id);
  if (known != ranks_.end()) return known->second;
  const auto& channels = survey_.topics.channels;
  if (!channels.contains(channel_id)) describe_all();
  const auto channel = channels.find(channel_id);
  const auto last = topic_order_.end();
  const auto topic = channel == channels.end() ? last : std::find(topic_order_.begin(), last, channel->second.topic);
  const auto rank = static_cast<std::uint32_t>(topic - topic_order_.begin()) + (topic == last ? channel_id : 0U);
  ranks_[channel_id] = rank;
  return rank;
}

Reader::Seen& Reader::seen_of(std::uint16_t channel_id) {
  const auto known = channels_seen_.find(channel_id);
  if (known != channels_seen_.end()) return *known->second;
  const auto& channels = survey_.topics.channels;
  const Channel& own = channels.at(channel_id);
  const auto same =
      std::find_if(channels.begin(), channels.end(), [&](const auto& other) { return other.second == own; });
  return *(channels_seen_[channel_id] = &topics_seen_[same->first]);
}

bool Reader::handed_out_before(const Message& message, const Seen& topic) const {
  if (!topic.any || message.sequence > topic.most_sequence) return false;
  return std::any_of(of_this_time_.begin(), of_this_time_.end(), [&](const HandedOut& other) {
    return other.message.sequence == message.sequence && other.topic == &topic &&
           std::ranges::equal(other.message.data, message.data);
  });
}

void Reader::hand_out(const OpenChunk& chunk, const Place& place, const Message& message, Seen& topic) {
  constexpr std::size_t kMostOfOneTime = 4096;  // a file without times must not make this grow, nor take for ever
  if (of_this_time_.size() == kMostOfOneTime) forget_time();
  of_this_time_.push_back({message, &topic});
  // A message that its writer added late has a later sequence: the file is as it was written.
  const bool backwards =
      std::pair(chunk.record.at, place.at) < std::pair(topic.chunk_at, topic.at) && message.sequence >= topic.sequence;
  if (topic.any && backwards && !counted_) backwards_.add(place.log_time_ns);
  topic = {true, chunk.record.at, place.at, message.sequence, std::max(topic.most_sequence, message.sequence)};
}

/// Nothing more is handed out of the time that was.
void Reader::forget_time() {
  of_this_time_.clear();
  for (Open& chunk : done_) recycle(std::move(chunk));
  done_.clear();
}

void Reader::recycle(Open chunk) {
  constexpr std::size_t kMostSpare = 2;
  if (spare_.size() < kMostSpare) spare_.push_back(std::move(chunk));
}

std::vector<std::string> Reader::order_notes() const {
  std::vector<std::string> notes;
  const auto at_s = [&](std::uint64_t time_ns) {
    const std::uint64_t first_ns = survey_.times ? std::min(survey_.times->first_ns, time_ns) : time_ns;
    return 1e-9 * static_cast<double>(time_ns - first_ns);
  };
  const auto counted = [](std::uint64_t count) {
    return count == 1 ? std::string("1 message stands") : fmt::format("{} messages stand", count);
  };
  if (backwards_.count > 0)
    notes.push_back(fmt::format("{}: not in the order of time, first at {:.3f} s: read in the order of log times",
                                file_.damages.file(), at_s(backwards_.first_ns)));
  if (twice_.count > 0)
    notes.push_back(fmt::format("{}: {} twice in it, first at {:.3f} s: counted once", file_.damages.file(),
                                counted(twice_.count), at_s(twice_.first_ns)));
  return notes;
}

void Reader::left_out(const Record& record, const ChunkHead& head, const std::string& why) {
  std::string when;
  if (const auto& times = survey_.times; times && head.first_time_ns <= head.last_time_ns &&
                                         times->first_ns <= head.first_time_ns && head.last_time_ns <= times->last_ns) {
    const auto seconds = [&](std::uint64_t time_ns) { return 1e-9 * static_cast<double>(time_ns - times->first_ns); };
    when = fmt::format("{:.1f} s to {:.1f} s", seconds(head.first_time_ns), seconds(head.last_time_ns));
  }
  const std::uint64_t messages = messages_of(file_, record);
  const std::string lost = messages > 0 ? fmt::format("{} messages", messages) : "its messages are";
  file_.damaged(record, why + "; " + lost + " left out", when);
}

}  // namespace knuckle::mcap
