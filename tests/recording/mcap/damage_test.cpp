// Files that were cut off, damaged, or are no recordings.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/text.h"
#include "recording/mcap/records.h"
#include "tests/recording/mcap/sample_file.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::mcap {
namespace {

class McapDamage : public testing::Test {
 protected:
  /// Three chunks (plain, zstd, plain) with an attachment and metadata between them; `end_[i]` is where chunk i and its
  /// indexes end.
  void SetUp() override {
    FileWriter writer;
    ASSERT_TRUE(writer.open(path_, sample_topics()));
    ASSERT_TRUE(writer.attach({"machine.toml", "application/toml", 1, 2, "name = 1\n"}));
    for (std::uint32_t i = 0; i < 3; ++i) {
      ASSERT_TRUE(writer.append(sample_chunk(i, i == 1 ? Compression{.zstd_level = 1} : Compression{})));
      end_.push_back(writer.bytes());
      const auto messages = sample_messages(i);
      all_.insert(all_.end(), messages.begin(), messages.end());
      ASSERT_TRUE(writer.note({"bookmark", {{"number", std::to_string(i)}}}));
    }
    killed_ = test::content(path_);
    ASSERT_TRUE(writer.close());
    whole_ = test::content(path_);
  }

  void put(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }
  /// Messages of the chunks that end before this byte.
  [[nodiscard]] std::vector<Kept> complete_before(std::size_t byte) const {
    const auto chunks = std::upper_bound(end_.begin(), end_.end(), byte) - end_.begin();
    return {all_.begin(), all_.begin() + chunks * kPerSecond};
  }
  static bool begins_with(const std::vector<Kept>& messages, const std::vector<Kept>& first) {
    return messages.size() >= first.size() && std::equal(first.begin(), first.end(), messages.begin());
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("a.mcap");
  std::string whole_, killed_;
  std::vector<std::uint64_t> end_;
  std::vector<Kept> all_;
};

TEST_F(McapDamage, AFileCutOffAnywhereGivesAllOfItsWholeChunks) {
  for (std::size_t size = kMagic.size(); size < whole_.size(); ++size) {
    put(whole_.substr(0, size));
    Reader reader(path_);
    ASSERT_TRUE(begins_with(read_all(reader), complete_before(size))) << "cut off after " << size << " bytes";
    ASSERT_FALSE(reader.complete()) << size;
    ASSERT_LE(reader.damages().size(), 2u) << size;
  }
}

TEST_F(McapDamage, AKilledRecordingIsReadWithoutComplaint) {
  put(killed_);
  Reader reader(path_);
  EXPECT_EQ(read_all(reader), all_);
  EXPECT_EQ(reader.metadata().size(), 3u);
  EXPECT_FALSE(reader.complete());
  EXPECT_EQ(reader.damages(), std::vector<std::string>{});
}

TEST_F(McapDamage, AFlippedBitNeitherHidesNorChangesAMessage) {
  for (const std::string& file : {whole_, killed_}) {
    put(file);
    std::fstream disk(path_, std::ios::binary | std::ios::in | std::ios::out);
    for (std::size_t bit = 8 * kMagic.size(); bit < 8 * file.size(); ++bit) {
      const std::size_t byte = bit / 8;
      const auto at_byte = static_cast<std::streamoff>(byte);
      disk.seekp(at_byte).put(static_cast<char>(file[byte] ^ 1 << bit % 8)).flush();
      Reader reader(path_);
      const auto messages = read_all(reader);
      ASSERT_TRUE(begins_with(messages, complete_before(byte))) << "byte " << byte;
      auto at = all_.begin();
      for (const Kept& m : messages) {
        at = std::find(at, all_.end(), m);
        ASSERT_NE(at, all_.end()) << "byte " << byte << " makes a " << m;
      }
      ASSERT_TRUE(messages == all_ || !reader.damages().empty()) << "byte " << byte << " hides messages";
      for (const std::string& line : reader.damages()) ASSERT_EQ(printable(line), line);
      disk.seekp(at_byte).put(file[byte]).flush();
    }
  }
}

TEST_F(McapDamage, ADamagedChunkIsToldAndTheNextOnesAreRead) {
  for (const std::size_t chunk : {std::size_t{0}, std::size_t{1}}) {
    std::string bytes = whole_;
    // The last message of the first, or the compressed block, before the indexes of its three channels.
    const std::size_t indexes = 3 * (kRecordHead_bytes + 2 + 4) + kPerSecond * 16;
    bytes[end_[chunk] - indexes - 2] ^= 1;
    put(bytes);
    Reader reader(path_);
    const auto messages = read_all(reader);
    EXPECT_EQ(messages.size(), 2 * kPerSecond);
    EXPECT_EQ(messages.back(), all_.back());
    ASSERT_EQ(reader.damages().size(), 1u);
    EXPECT_TRUE(test::begins(reader.damages()[0], path_ + ": chunk at byte "));
    EXPECT_TRUE(test::says(reader.damages()[0], chunk == 0 ? "(0.0 s to 0.8 s): " : "(1.0 s to 1.8 s): "));
    EXPECT_TRUE(test::says(reader.damages()[0], "; 6 messages left out"));
    reader.seek(0);
    EXPECT_EQ(read_all(reader), messages);
    EXPECT_EQ(reader.damages().size(), 1u) << "told twice";
  }
}

TEST_F(McapDamage, ADamagedAttachmentIsNotHandedOut) {
  std::string bytes = whole_;
  bytes[bytes.find("name = 1")] = 'N';
  put(bytes);
  Reader reader(path_);
  ASSERT_EQ(reader.attachments().size(), 1u);
  EXPECT_FALSE(reader.read(reader.attachments()[0]));
  ASSERT_EQ(reader.damages().size(), 1u);
  EXPECT_TRUE(test::says(reader.damages()[0], "attachment at byte"));
}

/// Of a file with one chunk that says this of itself.
std::vector<std::string> damages_of_chunk(const std::string& path, std::uint64_t uncompressed, const char* compression,
                                          const std::string& records) {
  Bytes bytes;
  Encoder to(bytes);
  to.append(kMagic.data(), kMagic.size());
  to.record(Opcode::kChunk, [&] {
    to.number(std::uint64_t{0});
    to.number(std::uint64_t{0});
    to.number(uncompressed);
    to.number(std::uint32_t{0});
    to.text(compression);
    to.number(std::uint64_t{records.size()});
    to.append(records.data(), records.size());
  });
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  Reader reader(path);
  EXPECT_FALSE(reader.next());
  return reader.damages();
}

TEST_F(McapDamage, AChunkThatClaimsTooMuchIsRefusedInOneLine) {
  struct Claim {
    std::uint64_t uncompressed;
    const char *compression, *said;
  };
  for (const Claim& claim : {Claim{10ull << 30, "zstd", "10737418240 bytes, at most 268435456 are read"},
                             {10ull << 30, "", "10737418240 bytes, at most 268435456 are read"},
                             {200, "zstd", "does not decompress to 200 bytes"},
                             {200, "lz4", "does not decompress to 200 bytes"},
                             {3, "lzma", "compressed by 'lzma'"},
                             {3, "", "its records do not fit into it"}}) {
    const auto damages = damages_of_chunk(path_, claim.uncompressed, claim.compression, "abc");
    ASSERT_EQ(damages.size(), 1u) << claim.said;
    EXPECT_TRUE(test::begins(damages[0], path_ + ": chunk at byte 8: " + claim.said));
  }
}

TEST_F(McapDamage, WhatIsNoRecordingIsRefusedInOneLine) {
  const auto refusal = [](const std::string& path) { return test::refusal([&] { const Reader reader(path); }); };
  for (const char* none : {"time_s,boom_rad\n0,0\n", ""}) {
    put(none);
    EXPECT_EQ(refusal(path_), path_ + ": not an MCAP file");
  }
  EXPECT_EQ(refusal(folder_.file("none.mcap")), folder_.file("none.mcap") + ": No such file or directory");
  EXPECT_EQ(refusal(folder_.path().string()), folder_.path().string() + ": not a regular file");
}

TEST_F(McapDamage, LinesAreBounded) {
  Bytes bytes;
  Encoder to(bytes);
  to.append(kMagic.data(), kMagic.size());
  for (int i = 0; i < 1000; ++i) to.record(Opcode::kChunk, [] {});
  put({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  Reader reader(path_);
  EXPECT_EQ(read_all(reader).size(), 0u);
  EXPECT_EQ(reader.damages().size(), 101u);
  EXPECT_EQ(reader.damages().back(), path_ + ": more is damaged than these 100 places");
}

}  // namespace
}  // namespace knuckle::mcap
