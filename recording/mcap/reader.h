// Reads the messages of an MCAP file in the order of their log times, in whatever order they stand in it. It needs no
// summary, so it reads recordings of killed programs; of a damaged file it hands out everything that is whole, and says
// what is not.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "recording/mcap/compression.h"
#include "recording/mcap/contents.h"
#include "recording/mcap/records.h"
#include "recording/mcap/survey.h"

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
  /// @param topics in the order in which messages of the same log time are handed out; others follow.
  /// @throws InputError where it cannot be opened or is no MCAP file.
  explicit Reader(const std::string& path, std::span<const char* const> topics = {});

  /// Program that wrote it, as it calls itself.
  [[nodiscard]] const std::string& library() const noexcept { return survey_.library; }
  /// What only chunks hold is here once next() has passed it.
  [[nodiscard]] const Topics& topics() const noexcept { return survey_.topics; }
  [[nodiscard]] const std::vector<Metadata>& metadata() const noexcept { return survey_.metadata; }
  [[nodiscard]] const std::vector<AttachmentEntry>& attachments() const noexcept { return survey_.attachments; }
  /// @param entry one of attachments(). @return nothing where it is damaged, which damages() tells.
  [[nodiscard]] std::optional<Attachment> read(const AttachmentEntry& entry);

  /// Earliest and latest log time, as the file says; nothing where it has no messages.
  [[nodiscard]] const std::optional<TimeSpan>& times() const noexcept { return survey_.times; }
  [[nodiscard]] std::size_t chunks() const noexcept { return survey_.chunks; }
  /// It has the end that a writer gives it: it was not killed, and nothing was cut off.
  [[nodiscard]] bool complete() const noexcept { return survey_.complete; }

  /// The next message by log time, of equal ones by topic, then by sequence; nothing at the end. One that stands in the
  /// file twice (same topic, sequence, log time and data) is handed out once.
  [[nodiscard]] std::optional<Message> next();
  /// next() begins anew, and hands out messages of this log time and later only. Chunks that end earlier are not read.
  void seek(std::uint64_t log_time_ns);

  /// One line for each place that is damaged: "FILE: chunk at byte 123456 (12.3 s to 12.8 s): CRC does not match; 612
  /// messages left out". What chunks and attachments hide is known once they were read.
  [[nodiscard]] const std::vector<std::string>& damages() const noexcept { return file_.damages.lines(); }
  /// What is unusual in the order of its messages, a line each; complete once next() has come to the end.
  [[nodiscard]] std::vector<std::string> order_notes() const;

 private:
  /// A message record's content in an open chunk.
  struct Place {
    std::uint64_t log_time_ns = 0;
    std::uint32_t rank = 0;  ///< Of its topic.
    std::uint32_t sequence = 0, at = 0, bytes = 0;
    [[nodiscard]] auto order() const noexcept { return std::tuple(log_time_ns, rank, sequence); }
  };
  /// A chunk whose messages are being handed out; or a stretch of the file with messages outside of chunks.
  struct OpenChunk {
    Record record;
    Bytes records;
    std::vector<Place> places;  ///< By order().
    std::size_t next = 0;
  };
  /// What was handed out of one topic. Channels that are the same are one: files that were joined have some twice.
  struct Seen {
    bool any = false;
    std::uint64_t chunk_at = 0;
    std::uint32_t at = 0;  ///< Of the last one, in that chunk.
    std::uint32_t sequence = 0, most_sequence = 0;
  };
  struct HandedOut {
    Message message;
    const Seen* topic;
  };
  /// How often something was met in the order of the messages, and when first.
  struct Oddity {
    std::uint64_t count = 0, first_ns = 0;
    void add(std::uint64_t log_time_ns) noexcept {
      if (count++ == 0) first_ns = log_time_ns;
    }
  };

  using Open = std::unique_ptr<OpenChunk>;
  /// Whether its next message comes behind that of the other one.
  [[nodiscard]] static bool later(const Open& chunk, const Open& other) noexcept;

  void open_what_is_due();
  void open(const MessagePlace& place);
  /// Decompressed and checked; where they are damaged, `why`.
  [[nodiscard]] bool unpack(const Record& record, const ChunkHead& head, Bytes& records, std::string& why);
  void find_messages(OpenChunk& chunk, const MessagePlace& place);
  void describe_all();
  [[nodiscard]] std::optional<Message> message_at(const OpenChunk& chunk, const Place& place);
  [[nodiscard]] std::uint32_t rank_of(std::uint16_t channel_id);
  [[nodiscard]] Seen& seen_of(std::uint16_t channel_id);
  [[nodiscard]] bool handed_out_before(const Message& message, const Seen& topic) const;
  void hand_out(const OpenChunk& chunk, const Place& place, const Message& message, Seen& topic);
  void forget_time();
  void recycle(Open chunk);
  void left_out(const Record& record, const ChunkHead& head, const std::string& why);

  RecordFile file_;
  std::vector<std::string> topic_order_;
  std::map<std::uint16_t, std::uint32_t> ranks_;  ///< By channel.
  Survey survey_;                                 ///< Its places by their first times.
  std::size_t next_place_ = 0;
  std::uint64_t not_before_ns_ = 0;
  std::vector<Open> open_;   ///< A heap; the one with the next message is in front.
  std::vector<Open> done_;   ///< Messages of the time that is handed out lie in them.
  std::vector<Open> spare_;  ///< Their memory is used again.
  std::vector<HandedOut> of_this_time_;
  std::map<std::uint16_t, Seen> topics_seen_;     ///< By the first of the channels that are the same.
  std::map<std::uint16_t, Seen*> channels_seen_;  ///< Where in it.
  Oddity backwards_, twice_;
  bool counted_ = false;  ///< The file was read to its end.
  bool described_ = false;
  Bytes packed_;
  ZstdDecompressor zstd_;
  Lz4Decompressor lz4_;
};

}  // namespace knuckle::mcap
