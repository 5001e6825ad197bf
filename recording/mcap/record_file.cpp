#include "recording/mcap/record_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace knuckle::mcap {

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
