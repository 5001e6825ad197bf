// Messages gathered into chunks: the unit that is compressed, written at once, and lost at most when a program is
// killed.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "recording/mcap/compression.h"
#include "recording/mcap/contents.h"

namespace knuckle::mcap {

struct Compression {
  std::optional<int> zstd_level;  ///< None: not compressed. Negative levels are the fast ones.
};

/// A finished chunk; may be written into any number of files that have its channels under the same ids.
struct Chunk {
  struct OfChannel {
    std::uint16_t id = 0;
    std::uint64_t messages = 0;
    std::uint64_t index_offset = 0;  ///< Of its Message Index record, from the chunk's start.
  };

  Bytes bytes;                      ///< The Chunk record and the Message Index records after it.
  std::uint32_t crc = 0;            ///< Of bytes.
  std::uint64_t first_time_ns = 0;  ///< Of log times, as the next; 0 where it has no messages.
  std::uint64_t last_time_ns = 0;
  std::uint64_t record_bytes = 0;        ///< Of the Chunk record.
  std::uint64_t compressed_bytes = 0;    ///< Of the messages as they are in it.
  std::uint64_t uncompressed_bytes = 0;  ///< Of the messages.
  bool zstd = false;
  std::vector<OfChannel> channels;  ///< Those with messages, by id.
};

class ChunkBuilder {
 public:
  ChunkBuilder();

  /// @param channel_id as Topics::add returned it.
  void add(std::uint16_t channel_id, std::uint32_t sequence, std::uint64_t log_time_ns, std::uint64_t publish_time_ns,
           std::span<const std::uint8_t> data);

  [[nodiscard]] bool empty() const noexcept { return messages_ == 0; }
  /// Of the messages added since the last finish(), uncompressed.
  [[nodiscard]] std::size_t bytes() const noexcept;
  /// Earliest log time of them; 0 where there are none.
  [[nodiscard]] std::uint64_t first_time_ns() const noexcept { return empty() ? 0 : first_time_ns_; }

  /// The messages added since the last call, and begins anew.
  /// @param recycled a chunk that is no longer needed: where its memory is large enough, none is allocated.
  [[nodiscard]] Chunk finish(Compression compression, Chunk recycled = {});

 private:
  struct IndexEntry {
    std::uint64_t log_time_ns, offset;
  };

  void append_indexes(Chunk& chunk) const;
  void begin();

  Bytes record_;                                  ///< Room for the head of an uncompressed chunk, then the messages.
  std::vector<std::vector<IndexEntry>> indexes_;  ///< By channel id.
  std::uint64_t messages_ = 0;
  std::uint64_t first_time_ns_ = 0, last_time_ns_ = 0;
  ZstdCompressor zstd_;
};

}  // namespace knuckle::mcap
