// Files of other writers: chunks and messages in any order, some of them twice, compressed otherwise, or without
// chunks. All give the same messages in the order of their log times.
#include <gtest/gtest.h>
#include <lz4frame.h>

#include <fstream>
#include <span>

#include "recording/mcap/records.h"
#include "tests/recording/mcap/sample_file.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::mcap {
namespace {

using Group = std::vector<Kept>;

/// A writer's choices. Schemas and channels stand where they are needed first, as most writers have them.
struct Style {
  std::string compression;
  bool chunks = true;
};

class McapOrder : public testing::Test {
 protected:
  McapOrder() {
    for (std::uint32_t second = 0; second < 4; ++second) {
      seconds_.push_back(sample_messages(second));
      for (Kept& message : seconds_.back()) message.sequence += kPerSecond / 3 * second;  // each channel's count on
      all_.insert(all_.end(), seconds_.back().begin(), seconds_.back().end());
    }
  }

  /// A file of these groups, each a chunk.
  void write(const std::vector<Group>& groups, const Style& style = {}) {
    Bytes file;
    Encoder to(file);
    to.append(kMagic.data(), kMagic.size());
    to.record(Opcode::kHeader, [&] {
      to.text("");
      to.text("another writer");
    });
    bool described = false;
    for (const Group& group : groups) {
      Bytes records;
      Encoder into(records);
      if (!std::exchange(described, true)) describe(into);
      for (const Kept& message : group) put(into, message);
      if (!style.chunks) {
        to.append(records.data(), records.size());
        continue;
      }
      const auto [first, last] = std::minmax_element(
          group.begin(), group.end(), [](const Kept& a, const Kept& b) { return a.log_time_ns < b.log_time_ns; });
      const Bytes packed = style.compression == "lz4" ? lz4(records) : records;
      to.record(Opcode::kChunk, [&] {
        to.number(first->log_time_ns);
        to.number(last->log_time_ns);
        to.number(std::uint64_t{records.size()});
        to.number(crc32(records));
        to.text(style.compression);
        to.number(std::uint64_t{packed.size()});
        to.append(packed.data(), packed.size());
      });
    }
    to.record(Opcode::kDataEnd, [&] { to.number(std::uint32_t{0}); });
    to.record(Opcode::kFooter, [&] {
      to.number(std::uint64_t{0});
      to.number(std::uint64_t{0});
      to.number(std::uint32_t{0});
    });
    to.append(kMagic.data(), kMagic.size());
    std::ofstream(path_, std::ios::binary).write(reinterpret_cast<const char*>(file.data()), std::ssize(file));
  }

  void expect(const std::vector<Kept>& messages, const std::vector<std::string>& notes) const {
    Reader reader(path_);
    EXPECT_EQ(read_all(reader), messages);
    EXPECT_EQ(reader.damages(), std::vector<std::string>{});
    EXPECT_EQ(reader.order_notes(), notes);
    reader.seek(0);
    EXPECT_EQ(read_all(reader), messages) << "again";
    EXPECT_EQ(reader.order_notes(), notes) << "once is enough";
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("a.mcap");
  std::vector<Group> seconds_;
  std::vector<Kept> all_;

 private:
  static void describe(Encoder& to) {
    const Topics topics = sample_topics();
    for (const auto& [id, schema] : topics.schemas) encode(to, id, schema);
    for (const auto& [id, channel] : topics.channels) encode(to, id, channel);
    encode(to, 9, topics.channels.at(2));  // a channel twice, as joined files have it
  }
  static void put(Encoder& to, const Kept& message) {
    to.record(Opcode::kMessage, [&] {
      to.number(message.channel_id);
      to.number(message.sequence);
      to.number(message.log_time_ns);
      to.number(message.publish_time_ns);
      to.append(message.data.data(), message.data.size());
    });
  }
  static Bytes lz4(const Bytes& bytes) {
    Bytes packed(LZ4F_compressFrameBound(bytes.size(), nullptr));
    packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
    return packed;
  }
};

TEST_F(McapOrder, MessagesComeByLogTimeHoweverTheChunksStand) {
  const std::string note = path_ + ": not in the order of time, first at ";
  write(seconds_);
  expect(all_, {});
  write({seconds_[0], seconds_[2], seconds_[1], seconds_[3]});
  expect(all_, {note + "2.000 s: read in the order of log times"});
  // The channels stand in the chunk that is read last.
  write({seconds_[3], seconds_[1], seconds_[0], seconds_[2]});
  expect(all_, {note + "1.000 s: read in the order of log times"});
}

TEST_F(McapOrder, MessagesComeByLogTimeAlsoWithinAChunkAndAcrossChunksThatOverlap) {
  Group even, odd, backwards(all_.rbegin(), all_.rend());
  for (std::size_t i = 0; i < all_.size(); ++i) (i % 2 == 0 ? even : odd).push_back(all_[i]);
  write({odd, even});
  Reader reader(path_);
  EXPECT_EQ(read_all(reader), all_);
  write({backwards});
  expect(all_, {path_ + ": not in the order of time, first at 0.450 s: read in the order of log times"});
}

TEST_F(McapOrder, LoopsThatFollowEachOtherWithinAChunkAreNothingToTell) {
  Group sides;  // each in its order, as the recorder drains them
  for (const int channel : {3, 1, 2})
    std::copy_if(all_.begin(), all_.end(), std::back_inserter(sides),
                 [&](const Kept& message) { return message.channel_id == channel; });
  write({sides});
  expect(all_, {});
}

TEST_F(McapOrder, MessageThatItsWriterAddedLateIsInItsPlaceAndNothingToTell) {
  Kept late = seconds_[0][0];
  late.log_time_ns = all_[8].log_time_ns + 1;
  late.sequence = 1000;
  write({seconds_[0], seconds_[1], seconds_[2], {late}, seconds_[3]});
  std::vector<Kept> expected = all_;
  expected.insert(expected.begin() + 9, late);
  Reader reader(path_);
  EXPECT_EQ(read_all(reader), expected);
  EXPECT_EQ(reader.order_notes(), std::vector<std::string>{});
}

TEST_F(McapOrder, WhatStandsTwiceIsHandedOutOnce) {
  write({seconds_[0], seconds_[1], seconds_[1], seconds_[2], seconds_[3]});
  const std::string twice = path_ + ": 6 messages stand twice in it, first at 1.000 s: counted once";
  expect(all_, {twice});
  Group renamed = seconds_[1];
  for (Kept& message : renamed)
    if (message.channel_id == 2) message.channel_id = 9;
  write({seconds_[0], seconds_[1], seconds_[2], seconds_[3], renamed});
  expect(all_, {twice});
}

TEST_F(McapOrder, WhatDiffersAnywhereIsNotTakenForTheSame) {
  for (const char* what : {"data", "sequence", "topic"}) {
    SCOPED_TRACE(what);
    Kept other = seconds_[1][2];
    ASSERT_FALSE(other.data.empty());
    if (what[0] == 'd') other.data[0] ^= 1;
    if (what[0] == 's') ++other.sequence;
    if (what[0] == 't') other.channel_id = 4;
    write({seconds_[0], seconds_[1], {other}});
    std::vector<Kept> expected(all_.begin(), all_.begin() + 2 * kPerSecond);
    expected.insert(expected.begin() + kPerSecond + 3, other);
    Reader reader(path_);
    EXPECT_EQ(read_all(reader), expected);
  }
}

TEST_F(McapOrder, Lz4AndNoChunksAtAllAreReadAlike) {
  write(seconds_, {.compression = "lz4", .chunks = true});
  expect(all_, {});
  write({seconds_[1], seconds_[0], seconds_[2], seconds_[3]}, {.compression = "", .chunks = false});
  expect(all_, {path_ + ": not in the order of time, first at 1.000 s: read in the order of log times"});
}

TEST_F(McapOrder, SeekFindsWhatStandsBeforeIt) {
  write({seconds_[3], seconds_[1], seconds_[0], seconds_[2]});
  Reader reader(path_);
  reader.seek(all_[10].log_time_ns);
  EXPECT_EQ(read_all(reader), std::vector<Kept>(all_.begin() + 10, all_.end()));
  EXPECT_EQ(reader.damages(), std::vector<std::string>{}) << "channels that stand in a chunk that is skipped";
}

TEST_F(McapOrder, AnLz4FrameThatIsCutOffOrTooLongIsDamage) {
  for (const int change : {-3, 5}) {
    write(seconds_, {.compression = "lz4", .chunks = true});
    std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
    std::string bytes((std::istreambuf_iterator<char>(file)), {});
    std::uint64_t said = 0;  // uncompressed size of the first chunk
    const std::size_t at = bytes.find("lz4") - 4 - 4 - 8;
    std::memcpy(&said, &bytes[at], sizeof said);
    said += static_cast<std::uint64_t>(change);
    file.seekp(static_cast<std::streamoff>(at)).write(reinterpret_cast<const char*>(&said), sizeof said).flush();
    Reader reader(path_);
    (void)read_all(reader);
    ASSERT_FALSE(reader.damages().empty());
    EXPECT_TRUE(test::says(reader.damages()[0], "does not decompress to " + std::to_string(said)));
  }
}

}  // namespace
}  // namespace knuckle::mcap
