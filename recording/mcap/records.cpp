#include "recording/mcap/records.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <libdeflate.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "core/error.h"

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

void Damages::add(std::string_view what, std::uint64_t at, std::string_view why, std::string_view when) {
  constexpr std::size_t kMostLines = 100;
  if (lines_.size() > kMostLines) return;
  const std::string in_brackets = when.empty() ? "" : fmt::format(" ({})", when);
  std::string line = fmt::format("{}: {} at byte {}{}: {}", file_, what, at, in_brackets, why);
  if (std::find(lines_.begin(), lines_.end(), line) != lines_.end()) return;
  if (lines_.size() == kMostLines) line = fmt::format("{}: more is damaged than these {} places", file_, kMostLines);
  lines_.push_back(std::move(line));
}

namespace {

constexpr std::uint64_t kWindow_bytes = 64 << 10;

std::string name_of(Opcode opcode) {
  switch (opcode) {
    case Opcode::kHeader:
      return "header";
    case Opcode::kFooter:
      return "footer";
    case Opcode::kSchema:
      return "schema";
    case Opcode::kChannel:
      return "channel";
    case Opcode::kMessage:
      return "message";
    case Opcode::kChunk:
      return "chunk";
    case Opcode::kMessageIndex:
      return "message index";
    case Opcode::kChunkIndex:
      return "chunk index";
    case Opcode::kAttachment:
      return "attachment";
    case Opcode::kAttachmentIndex:
      return "attachment index";
    case Opcode::kStatistics:
      return "statistics";
    case Opcode::kMetadata:
      return "metadata";
    case Opcode::kMetadataIndex:
      return "metadata index";
    case Opcode::kSummaryOffset:
      return "summary offset";
    case Opcode::kDataEnd:
      return "data end";
  }
  return fmt::format("record of kind 0x{:02x}", static_cast<int>(opcode));
}

}  // namespace

RecordFile::RecordFile(const std::string& path) : damages(path) {
  // Not to wait for a writer where it is a pipe.
  file_ = Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file_) throw InputError(path + ": " + std::strerror(errno));
  const auto refuse = [&](const std::string& why) { throw InputError(path + ": " + why); };
  struct stat status {};
  if (::fstat(file_.get(), &status) != 0) refuse(std::strerror(errno));
  if (!S_ISREG(status.st_mode)) refuse("not a regular file");
  size_ = static_cast<std::uint64_t>(status.st_size);
  Bytes magic;
  if (size_ < kMagic.size() || !read(0, kMagic.size(), magic) ||
      !std::equal(magic.begin(), magic.end(), kMagic.begin(),
                  [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); })) {
    refuse("not an MCAP file");
  }
}

std::optional<Record> RecordFile::record_at(std::uint64_t at) {
  if (at >= size_) return {};
  const std::uint64_t there = size_ - at;
  if (there < kRecordHead_bytes) {
    damages.add("record", at, fmt::format("cut off after {} bytes", there));
    return {};
  }
  const auto bytes = window(at, kRecordHead_bytes);
  if (!bytes) return {};
  Decoder head(*bytes);
  Record record{head.number<Opcode>(), at, kRecordHead_bytes};
  const auto length = head.number<std::uint64_t>();
  if (record.opcode == Opcode{0}) {
    damages.add("record", at, "its kind is 0, which none has");
    return {};
  }
  if (length > there - kRecordHead_bytes) {
    damages.add(name_of(record.opcode), at,
                fmt::format("cut off: {} of its {} bytes are there", there - kRecordHead_bytes, length));
    return {};
  }
  record.bytes += length;
  return record;
}

std::optional<std::span<const std::uint8_t>> RecordFile::content(const Record& record) {
  if (record.bytes > kLargestRecord_bytes) {
    damaged(record, fmt::format("{} bytes, at most {} are read; left out", record.bytes, kLargestRecord_bytes));
    return {};
  }
  return window(record.content_at(), record.content_bytes());
}

std::optional<std::span<const std::uint8_t>> RecordFile::content(const Record& record, std::uint64_t bytes) {
  return window(record.content_at(), std::min(bytes, record.content_bytes()));
}

std::optional<std::span<const std::uint8_t>> RecordFile::window(std::uint64_t at, std::uint64_t bytes) {
  if (at < window_at_ || at + bytes > window_at_ + window_.size()) {
    window_at_ = at;
    if (!read(at, std::clamp(kWindow_bytes, bytes, std::max(bytes, size_ - at)), window_)) {
      window_.clear();
      damages.add("file", at, "cannot be read");
      return {};
    }
  }
  return std::span<const std::uint8_t>(window_).subspan(at - window_at_, bytes);
}

bool RecordFile::read(std::uint64_t at, std::uint64_t bytes, Bytes& to) const {
  to.resize(bytes);
  for (std::size_t done = 0; done < bytes;) {
    const auto n = ::pread(file_.get(), to.data() + done, bytes - done, static_cast<off_t>(at + done));
    if (n > 0) {
      done += static_cast<std::size_t>(n);
    } else if (n == 0 || errno != EINTR) {
      return false;
    }
  }
  return true;
}

void RecordFile::damaged(const Record& record, std::string_view why, std::string_view when) {
  damages.add(name_of(record.opcode), record.at, why, when);
}

}  // namespace knuckle::mcap
