// Writes one MCAP file. Each call writes whole records with one system call, so that a killed program leaves a file
// that can be read up to its last whole chunk; after a call that failed, what it left is cut off again.
#pragma once

#include <cstdint>
#include <string>

#include "core/descriptor.h"
#include "recording/mcap/chunk.h"
#include "recording/mcap/contents.h"
#include "recording/mcap/records.h"

namespace knuckle::mcap {

/// Calls return whether all is written (given to the system; not whether the disk has it); where not, error() says why,
/// and the file ends with the record before. They may be tried again.
class FileWriter {
 public:
  FileWriter() = default;
  /// As close().
  ~FileWriter();
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;

  /// Makes a new file with these schemas and channels; one that exists is an error (EEXIST) and stays as it is. A file
  /// open so far is closed first. While it is open it has a shared flock(2), by which others see that it is written.
  [[nodiscard]] bool open(const std::string& path, const Topics& topics);
  [[nodiscard]] bool is_open() const noexcept { return bool(file_); }
  [[nodiscard]] bool append(const Chunk& chunk);
  [[nodiscard]] bool attach(const Attachment& attachment);
  [[nodiscard]] bool note(const Metadata& metadata);
  /// Writes the summary, for readers that want to find things quickly; the file is closed in any case. Nothing where
  /// none is open.
  bool close();
  /// Closes the file as it is, without a summary: readers see that it was not finished.
  void abandon();

  /// Written so far, of this file or of the last.
  [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_; }
  /// errno of the last call that failed.
  [[nodiscard]] int error() const noexcept { return error_; }

 private:
  /// Records of the summary, and how many they are.
  struct Group {
    Bytes records;
    std::uint32_t count = 0;
  };

  bool write(std::span<const std::uint8_t> records, std::uint32_t crc);
  [[nodiscard]] Bytes ending() const;
  void encode_statistics(Encoder& to) const;

  Descriptor file_;
  int error_ = 0;
  bool torn_ = false;  ///< There may be more in the file than bytes_.
  std::uint64_t bytes_ = 0;
  std::uint32_t crc_ = 0;  ///< Of what is written.

  Group schemas_, channels_, chunks_, attachments_, metadata_;
  std::uint64_t first_time_ns_ = 0, last_time_ns_ = 0, messages_ = 0;
  std::map<std::uint16_t, std::uint64_t> messages_of_;  ///< By channel id.
};

}  // namespace knuckle::mcap
