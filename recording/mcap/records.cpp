#include "recording/mcap/records.h"

#include <libdeflate.h>
#include <zlib.h>

#include <stdexcept>

namespace knuckle::mcap {
namespace {

template <typename Kind>
std::uint16_t add_next(std::map<std::uint16_t, Kind>& to, Kind kind) {
  const std::size_t id = to.empty() ? 1 : std::size_t{to.rbegin()->first} + 1;
  if (id > 0xffff) throw std::length_error("an MCAP file has at most 65535 schemas and channels");
  to.emplace(static_cast<std::uint16_t>(id), std::move(kind));
  return static_cast<std::uint16_t>(id);
}

}  // namespace

std::uint16_t Topics::add(Schema schema) {
  return add_next(schemas, std::move(schema));
}
std::uint16_t Topics::add(Channel channel) {
  return add_next(channels, std::move(channel));
}

void Encoder::texts(const Texts& values) {
  const std::size_t at = out_.size();
  number(std::uint32_t{0});
  for (const auto& [key, value] : values) {
    text(key);
    text(value);
  }
  overwrite(at, static_cast<std::uint32_t>(out_.size() - at - 4));
}

Texts Decoder::texts() {
  Decoder entries(bytes(number<std::uint32_t>()));
  Texts values;
  while (entries.ok() && !entries.rest().empty()) {
    const std::string_view key = entries.text();
    const std::string_view value = entries.text();
    if (entries.ok()) values.emplace(key, value);
  }
  ok_ = ok_ && entries.ok();
  return values;
}

void encode(Encoder& to, std::uint16_t id, const Schema& schema) {
  to.record(Opcode::kSchema, [&] {
    to.number(id);
    to.text(schema.name);
    to.text(schema.encoding);
    to.text(schema.data);
  });
}

void encode(Encoder& to, std::uint16_t id, const Channel& channel) {
  to.record(Opcode::kChannel, [&] {
    to.number(id);
    to.number(channel.schema_id);
    to.text(channel.topic);
    to.text(channel.message_encoding);
    to.texts(channel.metadata);
  });
}

void encode(Encoder& to, const Attachment& attachment) {
  to.record(Opcode::kAttachment, [&] {
    const std::size_t at = to.size();
    to.number(attachment.log_time_ns);
    to.number(attachment.create_time_ns);
    to.text(attachment.name);
    to.text(attachment.media_type);
    to.number(std::uint64_t{attachment.data.size()});
    to.append(attachment.data.data(), attachment.data.size());
    to.number(crc32(to.since(at)));
  });
}

void encode(Encoder& to, const Metadata& metadata) {
  to.record(Opcode::kMetadata, [&] {
    to.text(metadata.name);
    to.texts(metadata.values);
  });
}

std::uint32_t crc32(std::span<const std::uint8_t> bytes) noexcept {
  return libdeflate_crc32(0, bytes.data(), bytes.size());
}

std::uint32_t crc32_joined(std::uint32_t first, std::uint32_t second, std::uint64_t second_bytes) noexcept {
  return static_cast<std::uint32_t>(crc32_combine(first, second, static_cast<z_off_t>(second_bytes)));
}

}  // namespace knuckle::mcap
