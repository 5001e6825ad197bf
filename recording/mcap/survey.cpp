#include "recording/mcap/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace knuckle::mcap {
namespace {

constexpr std::string_view kCannotBeRead = "its fields do not fit into it; left out";

/// Adds what is new under its id. @return false where another is there.
template <typename Kind>
bool add_same(std::map<std::uint16_t, Kind>& to, std::uint16_t id, Kind kind) {
  const auto [at, added] = to.try_emplace(id, kind);
  return added || at->second == kind;
}

}  // namespace

std::optional<ChunkHead> chunk_head(RecordFile& file, const Record& record) {
  constexpr std::uint64_t kLongestHead = 1024;
  const auto bytes = file.content(record, kLongestHead);
  if (!bytes) return {};
  Decoder from(*bytes);
  ChunkHead head;
  head.first_time_ns = from.number<std::uint64_t>();
  head.last_time_ns = from.number<std::uint64_t>();
  head.uncompressed_bytes = from.number<std::uint64_t>();
  head.crc = from.number<std::uint32_t>();
  head.compression = from.text();
  head.records_bytes = from.number<std::uint64_t>();
  head.records_at = record.content_at() + (bytes->size() - from.rest().size());
  if (!from.ok() || head.records_bytes > record.end() - head.records_at) {
    file.damaged(record, kCannotBeRead);
    return {};
  }
  return head;
}

Survey::Survey(RecordFile& file) {
  std::uint64_t at = kMagic.size();
  Opcode before{};
  while (const auto record = file.record_at(at)) {
    if (record->opcode == Opcode::kDataEnd || record->opcode == Opcode::kFooter) {
      summary(file, record->opcode == Opcode::kDataEnd ? record->end() : record->at);
      break;
    }
    const bool indexed = before == Opcode::kChunk || before == Opcode::kMessageIndex;
    if (record->opcode == Opcode::kMessageIndex && !indexed) file.damaged(*record, "no chunk before it");
    data_record(file, *record);
    before = record->opcode;
    at = record->end();
  }
  if (chunks == 0) {
    places = std::move(stretches_);
    for (const MessagePlace& place : places) add_times(place.first_time_ns, place.last_time_ns);
  } else if (first_bare_) {
    // A writer puts all messages into chunks or none; beside chunks, something damaged looks like a message.
    file.damaged(*first_bare_,
                 bare_messages_ == 1
                     ? "outside of the file's chunks; left out"
                     : fmt::format("outside of the file's chunks, with {} others; left out", bare_messages_ - 1));
  }
}

void Survey::data_record(RecordFile& file, const Record& record) {
  switch (record.opcode) {
    case Opcode::kChunk:
      return add_chunk(file, record);
    case Opcode::kAttachment:
      return add_attachment(file, record);
    case Opcode::kMessage:
      return add_bare_message(file, record);
    case Opcode::kHeader:
    case Opcode::kSchema:
    case Opcode::kChannel:
    case Opcode::kMetadata:
      break;
    case Opcode::kChunkIndex:
    case Opcode::kAttachmentIndex:
    case Opcode::kStatistics:
    case Opcode::kMetadataIndex:
    case Opcode::kSummaryOffset:
      return file.damaged(record, "belongs to a summary, and is among the data");
    default:
      return;  // message indexes; and what a later version of the format or another program has added
  }
  const auto bytes = file.content(record);
  if (!bytes) return;
  Decoder content(*bytes);
  if (record.opcode == Opcode::kHeader) {
    (void)content.text();  // the profile: Knuckle follows none
    library = content.text();
    if (!content.ok()) file.damaged(record, kCannotBeRead);
  } else if (record.opcode == Opcode::kSchema) {
    add_schema(file, content, record);
  } else if (record.opcode == Opcode::kChannel) {
    add_channel(file, content, record);
  } else {
    add_metadata(file, content, record);
  }
}

bool Survey::fits(RecordFile& file, const Record& record, std::uint64_t bytes) {
  if (catalogue_bytes_ + bytes > kLargestCatalogue_bytes) {
    file.damages.add("file", record.at,
                     fmt::format("more than {} bytes describe its contents; what exceeds them is left out",
                                 kLargestCatalogue_bytes));
    return false;
  }
  catalogue_bytes_ += bytes;
  return true;
}

void Survey::add_schema(RecordFile& file, Decoder content, const Record& record) {
  const auto id = content.number<std::uint16_t>();
  Schema schema;
  schema.name = content.text();
  schema.encoding = content.text();
  schema.data = content.text();
  if (!content.ok()) return file.damaged(record, kCannotBeRead);
  if (id == 0) return;  // to be ignored, as the format says
  if (!topics.schemas.contains(id) && !fits(file, record, record.bytes)) return;
  if (!add_same(topics.schemas, id, std::move(schema)))
    file.damaged(record, fmt::format("schema {} was another one before", id));
}

void Survey::add_channel(RecordFile& file, Decoder content, const Record& record) {
  const auto id = content.number<std::uint16_t>();
  Channel channel;
  channel.schema_id = content.number<std::uint16_t>();
  channel.topic = content.text();
  channel.message_encoding = content.text();
  channel.metadata = content.texts();
  if (!content.ok()) return file.damaged(record, kCannotBeRead);
  if (!topics.channels.contains(id) && !fits(file, record, record.bytes)) return;
  if (!add_same(topics.channels, id, std::move(channel)))
    file.damaged(record, fmt::format("channel {} was another one before", id));
}

void Survey::add_metadata(RecordFile& file, Decoder content, const Record& record) {
  Metadata one;
  one.name = content.text();
  one.values = content.texts();
  if (!content.ok()) return file.damaged(record, kCannotBeRead);
  if (fits(file, record, record.bytes)) metadata.push_back(std::move(one));
}

void Survey::add_chunk(RecordFile& file, const Record& record) {
  ++chunks;
  const auto head = chunk_head(file, record);
  if (!head) return;
  const bool credible = head->first_time_ns <= head->last_time_ns;
  if (fits(file, record, sizeof(MessagePlace))) {
    places.push_back({record.at, record.bytes, credible ? head->first_time_ns : 0,
                      credible ? head->last_time_ns : std::numeric_limits<std::uint64_t>::max()});
  }
  // Both are zero where it has no messages.
  if (!credible || head->last_time_ns == 0) return;
  add_times(head->first_time_ns, head->last_time_ns);
}

void Survey::add_times(std::uint64_t first_ns, std::uint64_t last_ns) {
  if (!times) times = {first_ns, last_ns};
  times->first_ns = std::min(times->first_ns, first_ns);
  times->last_ns = std::max(times->last_ns, last_ns);
}

/// Into the stretch that is growing, up to a size that is read at once.
void Survey::add_bare_message(RecordFile& file, const Record& record) {
  constexpr std::uint64_t kStretch_bytes = 4 << 20;
  ++bare_messages_;
  if (!first_bare_) first_bare_ = record;
  MessagePlace place{record.at, record.bytes, 0, std::numeric_limits<std::uint64_t>::max()};
  const auto bytes = file.content(record, kMessageHead_bytes);
  if (!bytes) return;
  Decoder head(*bytes);
  (void)head.number<std::uint16_t>();
  (void)head.number<std::uint32_t>();
  const auto log_time_ns = head.number<std::uint64_t>();
  if (head.ok()) place.first_time_ns = place.last_time_ns = log_time_ns;
  if (!stretches_.empty()) {
    MessagePlace& last = stretches_.back();
    if (record.end() - last.at <= kStretch_bytes) {
      last = {last.at, record.end() - last.at, std::min(last.first_time_ns, place.first_time_ns),
              std::max(last.last_time_ns, place.last_time_ns)};
      return;
    }
  }
  if (fits(file, record, sizeof place)) stretches_.push_back(place);
}

void Survey::add_attachment(RecordFile& file, const Record& record) {
  constexpr std::uint64_t kLongestHead = 64 << 10;
  const auto bytes = file.content(record, kLongestHead);
  if (!bytes) return;
  Decoder head(*bytes);
  AttachmentEntry entry;
  entry.log_time_ns = head.number<std::uint64_t>();
  entry.create_time_ns = head.number<std::uint64_t>();
  entry.name = head.text();
  entry.media_type = head.text();
  entry.bytes = head.number<std::uint64_t>();
  entry.record_at = record.at;
  const std::uint64_t left = record.content_bytes() - (bytes->size() - head.rest().size());
  if (!head.ok() || left < sizeof(std::uint32_t) || entry.bytes > left - sizeof(std::uint32_t))
    return file.damaged(record, kCannotBeRead);
  const std::uint64_t described = sizeof entry + entry.name.size() + entry.media_type.size();
  if (fits(file, record, described)) attachments.push_back(std::move(entry));
}

/// Where it is whole, it tells what of the data is missing.
void Survey::summary(RecordFile& file, std::uint64_t start) {
  const std::uint64_t ending = kFooter_bytes + kMagic.size();
  const auto lost = [&](std::string_view why) { file.damages.add("summary", start, why); };
  if (file.size() < start + ending) return lost("cut off");
  const std::uint64_t footer_at = file.size() - ending;
  const auto footer = file.record_at(footer_at);
  if (!footer || footer->opcode != Opcode::kFooter || footer->bytes != kFooter_bytes)
    return lost("no footer at the end of the file");
  Bytes bytes;
  if (file.size() - start > kLargestRecord_bytes) return lost("too large to be read");
  if (!file.read(start, file.size() - start, bytes)) return lost("cannot be read");
  if (std::memcmp(bytes.data() + bytes.size() - kMagic.size(), kMagic.data(), kMagic.size()) != 0)
    return lost("the file's last bytes are not those of an MCAP file");
  const auto all = std::span<const std::uint8_t>(bytes).first(bytes.size() - kMagic.size());
  Decoder fields(all.last(kFooter_bytes - kRecordHead_bytes));
  const auto summary_at = fields.number<std::uint64_t>();
  (void)fields.number<std::uint64_t>();
  const auto crc = fields.number<std::uint32_t>();
  if (summary_at != 0 && summary_at != start) return lost("begins elsewhere, as the footer says");
  if (crc != 0 && crc != crc32(all.first(all.size() - sizeof crc))) return lost("CRC does not match; not used");
  complete = true;
  for (std::uint64_t at = start; at < footer_at;) {
    const auto record = file.record_at(at);
    if (!record) return;
    at = record->end();
    const auto content = record->end() <= footer_at ? file.content(*record) : std::nullopt;
    if (!content) continue;
    if (record->opcode == Opcode::kSchema) add_schema(file, Decoder(*content), *record);
    if (record->opcode == Opcode::kChannel) add_channel(file, Decoder(*content), *record);
    if (record->opcode == Opcode::kStatistics) statistics(file, Decoder(*content), *record);
  }
}

void Survey::statistics(RecordFile& file, Decoder content, const Record& record) {
  const auto messages = content.number<std::uint64_t>();
  (void)content.number<std::uint16_t>();
  (void)content.number<std::uint32_t>();
  const auto attachment_count = content.number<std::uint32_t>();
  const auto metadata_count = content.number<std::uint32_t>();
  const auto chunk_count = content.number<std::uint32_t>();
  const auto first_ns = content.number<std::uint64_t>();
  const auto last_ns = content.number<std::uint64_t>();
  if (!content.ok()) return file.damaged(record, kCannotBeRead);
  const auto expect = [&](std::size_t found, std::size_t named, std::string_view what) {
    if (found != named) file.damaged(record, fmt::format("{} {} are named, {} are there", named, what, found));
  };
  expect(chunks, chunk_count, "chunks");
  expect(attachments.size(), attachment_count, "attachments");
  expect(metadata.size(), metadata_count, "metadata records");
  if (messages > 0) times = {first_ns, last_ns};
}

}  // namespace knuckle::mcap
