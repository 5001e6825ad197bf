#include "recording/mcap/chunk.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "recording/mcap/records.h"

namespace knuckle::mcap {
namespace {

constexpr std::string_view kZstd = "zstd";

/// Of a Chunk record, before its messages.
constexpr std::size_t head_bytes(std::string_view compression) {
  return kRecordHead_bytes + 8 + 8 + 8 + 4 + (4 + compression.size()) + 8;
}
constexpr std::size_t kHead_bytes = head_bytes("");

template <typename Number>
std::uint8_t* put(std::uint8_t* at, Number value) noexcept {
  std::memcpy(at, &value, sizeof value);
  return at + sizeof value;
}

}  // namespace

ChunkBuilder::ChunkBuilder() {
  begin();
}

void ChunkBuilder::begin() {
  record_.resize(kHead_bytes);
  for (auto& index : indexes_) index.clear();
  messages_ = 0;
  first_time_ns_ = std::numeric_limits<std::uint64_t>::max();
  last_time_ns_ = 0;
}

std::size_t ChunkBuilder::bytes() const noexcept {
  return record_.size() - kHead_bytes;
}

void ChunkBuilder::add(std::uint16_t channel_id, std::uint32_t sequence, std::uint64_t log_time_ns,
                       std::uint64_t publish_time_ns, std::span<const std::uint8_t> data) {
  const std::size_t at = record_.size();
  record_.resize(at + kRecordHead_bytes + kMessageHead_bytes + data.size());
  std::uint8_t* to = record_.data() + at;
  to = put(to, Opcode::kMessage);
  to = put(to, std::uint64_t{kMessageHead_bytes + data.size()});
  to = put(to, channel_id);
  to = put(to, sequence);
  to = put(to, log_time_ns);
  to = put(to, publish_time_ns);
  if (!data.empty()) std::memcpy(to, data.data(), data.size());

  if (channel_id >= indexes_.size()) indexes_.resize(std::size_t{channel_id} + 1);
  indexes_[channel_id].push_back({log_time_ns, at - kHead_bytes});
  ++messages_;
  first_time_ns_ = std::min(first_time_ns_, log_time_ns);
  last_time_ns_ = std::max(last_time_ns_, log_time_ns);
}

Chunk ChunkBuilder::finish(Compression compression, Chunk recycled) {
  Chunk chunk = std::move(recycled);
  const std::span<const std::uint8_t> messages = std::span<const std::uint8_t>(record_).subspan(kHead_bytes);
  const std::uint32_t messages_crc = crc32(messages);
  chunk.uncompressed_bytes = messages.size();

  chunk.bytes.clear();
  chunk.zstd = false;
  if (compression.zstd_level) {
    chunk.bytes.resize(head_bytes(kZstd));
    chunk.zstd = zstd_.compress(messages, *compression.zstd_level, chunk.bytes);
  }
  if (!chunk.zstd) std::swap(chunk.bytes, record_);  // not a byte is copied
  const std::string_view name = chunk.zstd ? kZstd : "";
  const std::size_t head = head_bytes(name);
  chunk.record_bytes = chunk.bytes.size();
  chunk.compressed_bytes = chunk.record_bytes - head;
  chunk.first_time_ns = first_time_ns();
  chunk.last_time_ns = last_time_ns_;

  std::uint8_t* to = chunk.bytes.data();
  to = put(to, Opcode::kChunk);
  to = put(to, chunk.record_bytes - kRecordHead_bytes);
  to = put(to, chunk.first_time_ns);
  to = put(to, chunk.last_time_ns);
  to = put(to, chunk.uncompressed_bytes);
  to = put(to, messages_crc);
  to = put(to, static_cast<std::uint32_t>(name.size()));
  to = std::copy(name.begin(), name.end(), to);
  put(to, chunk.compressed_bytes);
  append_indexes(chunk);

  const std::span<const std::uint8_t> all(chunk.bytes);
  const auto crc_of_messages = chunk.zstd ? crc32(all.subspan(head, chunk.compressed_bytes)) : messages_crc;
  const auto after = all.subspan(chunk.record_bytes);
  chunk.crc = crc32_joined(crc32_joined(crc32(all.first(head)), crc_of_messages, chunk.compressed_bytes), crc32(after),
                           after.size());
  begin();
  return chunk;
}

void ChunkBuilder::append_indexes(Chunk& chunk) const {
  chunk.channels.clear();
  Encoder to(chunk.bytes);
  for (std::size_t id = 0; id < indexes_.size(); ++id) {
    const auto& entries = indexes_[id];
    if (entries.empty()) continue;
    chunk.channels.push_back({static_cast<std::uint16_t>(id), entries.size(), to.size()});
    to.record(Opcode::kMessageIndex, [&] {
      const std::size_t bytes = entries.size() * sizeof(IndexEntry);
      to.number(static_cast<std::uint16_t>(id));
      to.number(static_cast<std::uint32_t>(bytes));
      to.append(entries.data(), bytes);
    });
  }
}

}  // namespace knuckle::mcap
