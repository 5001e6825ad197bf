// Reads an MCAP file from its beginning to its end. It needs no summary, so it reads recordings of killed programs; of
// a damaged file it hands out everything that is whole, and says what is not.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "recording/mcap/contents.h"
#include "recording/mcap/record_file.h"
#include "recording/mcap/survey.h"
#include "recording/mcap/zstd.h"

namespace knuckle::mcap {

struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::span<const std::uint8_t> data;  ///< Until next() or seek().
};

class Reader {
 public:
  /// Looks through the file's records, but not into its chunks.
  /// @throws InputError where it cannot be opened or is no MCAP file.
  explicit Reader(const std::string& path);

  /// Program that wrote it, as it calls itself.
  [[nodiscard]] const std::string& library() const noexcept { return survey_.library; }
  /// What only chunks hold is here once next() has passed it.
  [[nodiscard]] const Topics& topics() const noexcept { return survey_.topics; }
  [[nodiscard]] const std::vector<Metadata>& metadata() const noexcept { return survey_.metadata; }
  [[nodiscard]] const std::vector<AttachmentEntry>& attachments() const noexcept { return survey_.attachments; }
  /// @param entry one of attachments(). @return nothing where it is damaged, which damages() tells.
  [[nodiscard]] std::optional<Attachment> read(const AttachmentEntry& entry);

  /// Earliest and latest log time of messages in chunks; nothing where it has none.
  [[nodiscard]] const std::optional<TimeSpan>& times() const noexcept { return survey_.times; }
  [[nodiscard]] std::size_t chunks() const noexcept { return survey_.chunks; }
  /// It has the end that a writer gives it: it was not killed, and nothing was cut off.
  [[nodiscard]] bool complete() const noexcept { return survey_.complete; }

  /// The next message in the order of the file; nothing at its end.
  [[nodiscard]] std::optional<Message> next();
  /// next() begins anew, and hands out messages of this log time and later only. Chunks that end earlier are not read.
  void seek(std::uint64_t log_time_ns);

  /// One line for each place that is damaged: "FILE: chunk at byte 123456 (12.3 s to 12.8 s): CRC does not match; 612
  /// messages left out". What chunks and attachments hide is known once they were read.
  [[nodiscard]] const std::vector<std::string>& damages() const noexcept { return file_.damages.lines(); }

 private:
  void enter_chunk(const Record& record);
  /// The messages of a chunk, decompressed and checked; where they are damaged, `why`.
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> unpack(const Record& record, const ChunkHead& head,
                                                                    std::string& why);
  [[nodiscard]] std::optional<Message> next_in_chunk();
  [[nodiscard]] std::optional<Message> bare_message(const Record& record);
  [[nodiscard]] std::optional<Message> message_of(Decoder content, const Record& holder);
  void left_out(const Record& record, const ChunkHead& head, const std::string& why);

  RecordFile file_;
  Survey survey_;
  std::uint64_t at_;  ///< The record after the one that is handed out.
  std::uint64_t not_before_ns_ = 0;
  Record chunk_;          ///< That is handed out.
  Decoder in_chunk_{{}};  ///< The rest of it.
  Bytes packed_, unpacked_;
  ZstdDecompressor zstd_;
};

}  // namespace knuckle::mcap
