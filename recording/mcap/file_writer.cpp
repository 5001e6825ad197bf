#include "recording/mcap/file_writer.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

namespace knuckle::mcap {

FileWriter::~FileWriter() {
  close();
}

bool FileWriter::open(const std::string& path, const Topics& topics) {
  close();
  Descriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (!file) {
    error_ = errno;
    return false;
  }
  // Says to others that it is being written; waits for one that is just looking. On NFS it needs a file open to be
  // read.
  while (::flock(file.get(), LOCK_SH) != 0 && errno == EINTR) {
  }
  file_ = std::move(file);
  torn_ = false;
  bytes_ = crc_ = 0;
  schemas_ = channels_ = chunks_ = attachments_ = metadata_ = {};
  first_time_ns_ = last_time_ns_ = messages_ = 0;
  messages_of_.clear();

  for (const auto& [id, schema] : topics.schemas) {
    Encoder to(schemas_.records);
    encode(to, id, schema);
    ++schemas_.count;
  }
  for (const auto& [id, channel] : topics.channels) {
    Encoder to(channels_.records);
    encode(to, id, channel);
    ++channels_.count;
  }
  Bytes beginning;
  Encoder to(beginning);
  to.append(kMagic.data(), kMagic.size());
  to.record(Opcode::kHeader, [&] {
    to.text("");
    to.text(std::string("knuckle ") + KNUCKLE_VERSION);
  });
  to.append(schemas_.records.data(), schemas_.records.size());
  to.append(channels_.records.data(), channels_.records.size());
  if (write(beginning, crc32(beginning))) return true;
  file_.close();
  ::unlink(path.c_str());  // it is ours, and holds nothing
  return false;
}

bool FileWriter::append(const Chunk& chunk) {
  const std::uint64_t at = bytes_;
  if (!write(chunk.bytes, chunk.crc)) return false;
  Encoder to(chunks_.records);
  to.record(Opcode::kChunkIndex, [&] {
    to.number(chunk.first_time_ns);
    to.number(chunk.last_time_ns);
    to.number(at);
    to.number(chunk.record_bytes);
    to.number(static_cast<std::uint32_t>(chunk.channels.size() * (2 + 8)));
    for (const Chunk::OfChannel& channel : chunk.channels) {
      to.number(channel.id);
      to.number(at + channel.index_offset);
    }
    to.number(chunk.bytes.size() - chunk.record_bytes);
    to.text(chunk.zstd ? "zstd" : "");
    to.number(chunk.compressed_bytes);
    to.number(chunk.uncompressed_bytes);
  });
  ++chunks_.count;
  if (!chunk.channels.empty()) {
    first_time_ns_ = messages_ == 0 ? chunk.first_time_ns : std::min(first_time_ns_, chunk.first_time_ns);
    last_time_ns_ = std::max(last_time_ns_, chunk.last_time_ns);
  }
  for (const Chunk::OfChannel& channel : chunk.channels) {
    messages_ += channel.messages;
    messages_of_[channel.id] += channel.messages;
  }
  return true;
}

bool FileWriter::attach(const Attachment& attachment) {
  Bytes record;
  Encoder record_to(record);
  encode(record_to, attachment);
  const std::uint64_t at = bytes_;
  if (!write(record, crc32(record))) return false;
  Encoder to(attachments_.records);
  to.record(Opcode::kAttachmentIndex, [&] {
    to.number(at);
    to.number(std::uint64_t{record.size()});
    to.number(attachment.log_time_ns);
    to.number(attachment.create_time_ns);
    to.number(std::uint64_t{attachment.data.size()});
    to.text(attachment.name);
    to.text(attachment.media_type);
  });
  ++attachments_.count;
  return true;
}

bool FileWriter::note(const Metadata& metadata) {
  Bytes record;
  Encoder record_to(record);
  encode(record_to, metadata);
  const std::uint64_t at = bytes_;
  if (!write(record, crc32(record))) return false;
  Encoder to(metadata_.records);
  to.record(Opcode::kMetadataIndex, [&] {
    to.number(at);
    to.number(std::uint64_t{record.size()});
    to.text(metadata.name);
  });
  ++metadata_.count;
  return true;
}

bool FileWriter::close() {
  if (!is_open()) return true;
  const Bytes end = ending();
  const bool written = write(end, 0);  // of the whole file nobody asks a CRC
  // Where the disk was full, space may be promised and refused only now (NFS).
  const int refused = file_.close();
  if (written && refused != 0) error_ = refused;
  return written && refused == 0;
}

void FileWriter::abandon() {
  file_.close();
}

/// Data End, summary and footer.
Bytes FileWriter::ending() const {
  Bytes end;
  Encoder to(end);
  to.record(Opcode::kDataEnd, [&] { to.number(crc_); });

  const std::size_t summary = to.size();
  Bytes offsets;
  Encoder offsets_to(offsets);
  const auto group = [&](Opcode opcode, const Bytes& records) {
    if (records.empty()) return;
    offsets_to.record(Opcode::kSummaryOffset, [&] {
      offsets_to.number(opcode);
      offsets_to.number(bytes_ + to.size());
      offsets_to.number(std::uint64_t{records.size()});
    });
    to.append(records.data(), records.size());
  };
  Bytes statistics;
  Encoder statistics_to(statistics);
  encode_statistics(statistics_to);
  group(Opcode::kSchema, schemas_.records);
  group(Opcode::kChannel, channels_.records);
  group(Opcode::kStatistics, statistics);
  group(Opcode::kChunkIndex, chunks_.records);
  group(Opcode::kAttachmentIndex, attachments_.records);
  group(Opcode::kMetadataIndex, metadata_.records);

  const std::uint64_t offsets_start = bytes_ + to.size();
  to.append(offsets.data(), offsets.size());
  to.record(Opcode::kFooter, [&] {
    to.number(bytes_ + summary);
    to.number(offsets_start);
    to.number(std::uint32_t{0});
  });
  // The CRC covers the footer's head too, whose length is there only now.
  const std::size_t crc_at = to.size() - sizeof(std::uint32_t);
  to.overwrite(crc_at, crc32(std::span<const std::uint8_t>(end).subspan(summary, crc_at - summary)));
  to.append(kMagic.data(), kMagic.size());
  return end;
}

void FileWriter::encode_statistics(Encoder& to) const {
  to.record(Opcode::kStatistics, [&] {
    to.number(messages_);
    to.number(static_cast<std::uint16_t>(schemas_.count));
    to.number(channels_.count);
    to.number(attachments_.count);
    to.number(metadata_.count);
    to.number(chunks_.count);
    to.number(first_time_ns_);
    to.number(last_time_ns_);
    to.number(static_cast<std::uint32_t>(messages_of_.size() * (2 + 8)));
    for (const auto& [id, count] : messages_of_) {
      to.number(id);
      to.number(count);
    }
  });
}

/// At the end of what is whole; of a failed write nothing stays.
bool FileWriter::write(std::span<const std::uint8_t> records, std::uint32_t crc) {
  const auto failed = [&](int error) {
    error_ = error;
    return false;
  };
  if (!is_open()) return failed(EBADF);
  if (torn_ && ::ftruncate(file_.get(), static_cast<off_t>(bytes_)) != 0) return failed(errno);
  torn_ = false;
  // A limit on the size of files is an error like others, and not the signal that ends a program.
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) == 0 && bytes_ + records.size() > limit.rlim_cur) return failed(EFBIG);
  for (std::size_t done = 0; done < records.size();) {
    const auto n =
        ::pwrite(file_.get(), records.data() + done, records.size() - done, static_cast<off_t>(bytes_ + done));
    if (n > 0) {
      done += static_cast<std::size_t>(n);
    } else if (n == 0 || errno != EINTR) {
      error_ = n == 0 ? ENOSPC : errno;
      torn_ = done > 0 && ::ftruncate(file_.get(), static_cast<off_t>(bytes_)) != 0;
      return false;
    }
  }
  crc_ = crc32_joined(crc_, crc, records.size());
  bytes_ += records.size();
  return true;
}

}  // namespace knuckle::mcap
