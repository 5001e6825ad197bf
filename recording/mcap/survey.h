// What an MCAP file says about itself outside of its chunks.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recording/mcap/contents.h"
#include "recording/mcap/records.h"

namespace knuckle::mcap {

/// Bytes of schemas, channels, metadata, names of attachments and places of chunks together; what exceeds them is left
/// out.
inline constexpr std::uint64_t kLargestCatalogue_bytes = 16 << 20;

struct AttachmentEntry {
  std::string name;
  std::string media_type;
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;  ///< 0: not known.
  std::uint64_t bytes = 0;
  std::uint64_t record_at = 0;  ///< From the start of the file.
};

/// The beginning of a Chunk record.
struct ChunkHead {
  std::uint64_t first_time_ns = 0, last_time_ns = 0, uncompressed_bytes = 0;
  std::uint32_t crc = 0;  ///< 0: has none.
  std::string compression;
  std::uint64_t records_at = 0, records_bytes = 0;  ///< In the file.
};
/// Nothing where it is damaged, which is told.
[[nodiscard]] std::optional<ChunkHead> chunk_head(RecordFile& file, const Record& record);

/// Where messages are: a chunk, or in a file without any a stretch of records. Both times are of all messages in it, as
/// far as is told: where that is not credible, from the first to the last time there is.
struct MessagePlace {
  std::uint64_t at = 0, bytes = 0;
  std::uint64_t first_time_ns = 0, last_time_ns = 0;
};

struct TimeSpan {
  std::uint64_t first_ns = 0, last_ns = 0;
};

class Survey {
 public:
  /// Goes through all records of the file, but not into chunks.
  explicit Survey(RecordFile& file);

  std::string library;
  Topics topics;
  std::vector<Metadata> metadata;
  std::vector<AttachmentEntry> attachments;
  std::optional<TimeSpan> times;  ///< Of log times, as the summary or else the chunks say; without chunks of all.
  std::size_t chunks = 0;
  bool complete = false;  ///< It ends with data end, footer and magic.

  std::vector<MessagePlace> places;  ///< In the order of the file.

  /// The content of a record; one whose id is known already must be the same.
  void add_schema(RecordFile& file, Decoder content, const Record& record);
  void add_channel(RecordFile& file, Decoder content, const Record& record);

 private:
  void data_record(RecordFile& file, const Record& record);
  void add_chunk(RecordFile& file, const Record& record);
  void add_bare_message(RecordFile& file, const Record& record);
  void add_times(std::uint64_t first_ns, std::uint64_t last_ns);
  void add_attachment(RecordFile& file, const Record& record);
  void add_metadata(RecordFile& file, Decoder content, const Record& record);
  void summary(RecordFile& file, std::uint64_t start);
  void statistics(RecordFile& file, Decoder content, const Record& record);
  [[nodiscard]] bool fits(RecordFile& file, const Record& record, std::uint64_t bytes);

  std::uint64_t catalogue_bytes_ = 0;
  std::vector<MessagePlace> stretches_;  ///< Of messages outside of chunks.
  std::uint64_t bare_messages_ = 0;
  std::optional<Record> first_bare_;
};

}  // namespace knuckle::mcap
