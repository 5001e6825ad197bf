#include "recording/mcap/reader.h"

#include <fmt/format.h>

#include <algorithm>

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

Reader::Reader(const std::string& path) : file_(path), survey_(file_), at_(kMagic.size()) {}

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
  in_chunk_ = Decoder({});
  at_ = kMagic.size();
  const auto& places = survey_.places;
  const auto first =
      std::find_if(places.begin(), places.end(), [&](const auto& place) { return place.last_time_ns >= log_time_ns; });
  // Beyond those that are known there may be more.
  if (first != places.end())
    at_ = first->at;
  else if (!places.empty())
    at_ = places.back().at;
}

std::optional<Message> Reader::next() {
  for (;;) {
    while (!in_chunk_.rest().empty()) {
      const auto message = next_in_chunk();
      if (message && message->log_time_ns >= not_before_ns_) return message;
    }
    if (at_ >= survey_.data_end) return {};
    const auto record = file_.record_at(at_);
    if (!record) {
      at_ = survey_.data_end;
      return {};
    }
    at_ = record->end();
    if (record->opcode == Opcode::kChunk) {
      enter_chunk(*record);
    } else if (record->opcode == Opcode::kMessage) {
      const auto message = bare_message(*record);
      if (message && message->log_time_ns >= not_before_ns_) return message;
    }
  }
}

void Reader::enter_chunk(const Record& record) {
  const auto head = chunk_head(file_, record);
  if (!head) return;
  if (head->first_time_ns <= head->last_time_ns && head->last_time_ns < not_before_ns_) return;
  std::string why;
  if (const auto messages = unpack(record, *head, why)) {
    chunk_ = record;
    in_chunk_ = Decoder(*messages);
  } else {
    left_out(record, *head, why);
  }
}

std::optional<std::span<const std::uint8_t>> Reader::unpack(const Record& record, const ChunkHead& head,
                                                            std::string& why) {
  if (const auto largest = std::max(record.bytes, head.uncompressed_bytes); largest > kLargestRecord_bytes) {
    why = fmt::format("{} bytes, at most {} are read", largest, kLargestRecord_bytes);
    return {};
  }
  const bool zstd = head.compression == "zstd";
  if (!zstd && !head.compression.empty()) {
    why = fmt::format("compressed by '{}'; only zstd is read", shortened(head.compression));
    return {};
  }
  if (!file_.read(head.records_at, head.records_bytes, packed_)) {
    why = "cannot be read";
    return {};
  }
  const bool whole =
      zstd ? zstd_.decompress(packed_, head.uncompressed_bytes, unpacked_) : packed_.size() == head.uncompressed_bytes;
  if (!whole) {
    why = fmt::format("does not decompress to {} bytes", head.uncompressed_bytes);
    return {};
  }
  const std::span<const std::uint8_t> messages(zstd ? unpacked_ : packed_);
  if (head.crc != 0 && head.crc != crc32(messages)) {
    why = "CRC does not match";
    return {};
  }
  return messages;
}

/// Nothing where the next record is no message that can be handed out.
std::optional<Message> Reader::next_in_chunk() {
  const auto opcode = in_chunk_.number<Opcode>();
  const auto content = in_chunk_.bytes(in_chunk_.number<std::uint64_t>());
  if (!in_chunk_.ok()) {
    file_.damaged(chunk_, "its records do not fit into it; those after the last whole one left out");
    in_chunk_ = Decoder({});
    return {};
  }
  if (opcode == Opcode::kMessage) return message_of(Decoder(content), chunk_);
  if (opcode == Opcode::kSchema) survey_.add_schema(file_, Decoder(content), chunk_);
  if (opcode == Opcode::kChannel) survey_.add_channel(file_, Decoder(content), chunk_);
  return {};
}

/// A writer puts all messages into chunks or none; beside chunks, something damaged looks like a message.
std::optional<Message> Reader::bare_message(const Record& record) {
  if (survey_.chunks > 0) {
    file_.damaged(record, "outside of the file's chunks; left out");
    return {};
  }
  const auto bytes = file_.content(record);
  return bytes ? message_of(Decoder(*bytes), record) : std::nullopt;
}

std::optional<Message> Reader::message_of(Decoder content, const Record& holder) {
  Message message;
  message.channel_id = content.number<std::uint16_t>();
  message.sequence = content.number<std::uint32_t>();
  message.log_time_ns = content.number<std::uint64_t>();
  message.publish_time_ns = content.number<std::uint64_t>();
  message.data = content.rest();
  if (!content.ok()) {
    file_.damaged(holder, "a message is too short; left out");
    return {};
  }
  if (!survey_.topics.channels.contains(message.channel_id)) {
    file_.damaged(holder, fmt::format("channel {} is not described; its messages left out", message.channel_id));
    return {};
  }
  return message;
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
