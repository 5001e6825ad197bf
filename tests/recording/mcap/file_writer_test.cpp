// The bytes of a file as the format asks for them, and disks that refuse.
#include <gtest/gtest.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/recording/mcap/sample_file.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/small_disk.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::mcap {
namespace {

using test::SmallDisk;
using test::TemporaryFolder;

/// Readable where they differ.
std::string hex(const std::string& bytes) {
  std::string out;
  for (const char c : bytes) {
    constexpr const char* kDigits = "0123456789ABCDEF";
    out += kDigits[static_cast<unsigned char>(c) >> 4];
    out += kDigits[c & 15];
  }
  return out;
}

TEST(McapFileWriter, WritesTheBytesOfTheSpecification) {
  const TemporaryFolder folder;
  Topics topics;
  topics.add(Channel{"/a", "json", topics.add(Schema{"s", "jsonschema", "{}"}), {{"k", "v"}}});
  FileWriter writer;
  ASSERT_TRUE(writer.open(folder.file("a.mcap"), topics));
  ChunkBuilder builder;
  const std::vector<std::uint8_t> data{0xAA, 0xBB};
  builder.add(1, 7, 0x102030405060708, 0x1112131415161718, data);
  ASSERT_TRUE(writer.append(builder.finish({})));
  ASSERT_TRUE(writer.close());
  const std::string file = test::content(folder.file("a.mcap"));

  // Encoded by hand from the tables of https://mcap.dev/spec, CRCs by zlib.
  const std::string expected =
      // magic
      "894D434150300D0A"
      // header
      "011500000000000000000000000D0000006B6E75636B6C6520302E312E30"
      // schema
      "031B00000000000000010001000000730A0000006A736F6E736368656D61020000007B7D"
      // channel
      "04200000000000000001000100020000002F61040000006A736F6E0A000000010000006B01000000"
      "76"
      // chunk
      "06490000000000000008070605040302010807060504030201210000000000000040EFB170000000"
      "00210000000000000005180000000000000001000700000008070605040302011817161514131211"
      "AABB"
      // message index
      "07160000000000000001001000000008070605040302010000000000000000"
      // data end
      "0F0400000000000000F382FD0A"
      // schema
      "031B00000000000000010001000000730A0000006A736F6E736368656D61020000007B7D"
      // channel
      "04200000000000000001000100020000002F61040000006A736F6E0A000000010000006B01000000"
      "76"
      // statistics
      "0B380000000000000001000000000000000100010000000000000000000000010000000807060504"
      "03020108070605040302010A00000001000100000000000000"
      // chunk index
      "084A0000000000000008070605040302010807060504030201730000000000000052000000000000"
      "000A0000000100C5000000000000001F000000000000000000000021000000000000002100000000"
      "000000"
      // summary offset
      "0E110000000000000003F1000000000000002400000000000000"
      // summary offset
      "0E11000000000000000415010000000000002900000000000000"
      // summary offset
      "0E11000000000000000B3E010000000000004100000000000000"
      // summary offset
      "0E1100000000000000087F010000000000005300000000000000"
      // footer
      "021400000000000000F100000000000000D20100000000000032D9AC05"
      // magic
      "894D434150300D0A";
  EXPECT_EQ(hex(file), expected);
}

TEST(McapFileWriter, NeverOverwritesAFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.mcap");
  std::ofstream(path) << "precious";
  FileWriter writer;
  EXPECT_FALSE(writer.open(path, sample_topics()));
  EXPECT_EQ(writer.error(), EEXIST);
  EXPECT_FALSE(writer.is_open());
  EXPECT_EQ(test::content(path), "precious");
}

TEST(McapFileWriter, SaysWhyAFileCannotBeMade) {
  const TemporaryFolder folder;
  FileWriter writer;
  EXPECT_FALSE(writer.open(folder.file("none/a.mcap"), sample_topics()));
  EXPECT_EQ(writer.error(), ENOENT);
  EXPECT_FALSE(writer.append(sample_chunk(1)));
  EXPECT_EQ(writer.error(), EBADF);
  EXPECT_TRUE(writer.close()) << "there is nothing to close";
}

TEST(McapFileWriter, AFileWithoutMessagesIsWholeAndTheWriterGoesOnWithTheNext) {
  const TemporaryFolder folder;
  FileWriter writer;
  for (const char* name : {"first.mcap", "a.mcap"}) ASSERT_TRUE(writer.open(folder.file(name), {})) << name;
  ASSERT_TRUE(writer.close());
  EXPECT_TRUE(Reader(folder.file("first.mcap")).complete());
  EXPECT_EQ(writer.bytes(), std::filesystem::file_size(folder.file("a.mcap")));
  Reader reader(folder.file("a.mcap"));
  EXPECT_TRUE(reader.complete());
  EXPECT_FALSE(reader.next());
  EXPECT_FALSE(reader.times());
  EXPECT_EQ(reader.library(), "knuckle 0.1.0");
}

TEST(McapFileWriter, ALimitOnTheFilesSizeIsAnErrorAndLeavesWholeRecords) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.mcap");
  FileWriter writer;
  ASSERT_TRUE(writer.open(path, sample_topics()));
  ASSERT_TRUE(writer.append(sample_chunk(1)));
  const std::uint64_t size = writer.bytes();
  {
    const test::FileSizeLimit limit(size + 100);
    EXPECT_FALSE(writer.append(sample_chunk(2)));
    EXPECT_EQ(writer.error(), EFBIG);
    EXPECT_FALSE(writer.attach({"large", "", 0, 0, std::string(1000, 'x')}));
    EXPECT_EQ(writer.bytes(), size);
    EXPECT_EQ(std::filesystem::file_size(path), size);
  }
  EXPECT_TRUE(writer.append(sample_chunk(3))) << "there is room again";
  EXPECT_TRUE(writer.close());
  Reader reader(path);
  EXPECT_EQ(read_all(reader).size(), 2 * kPerSecond);
  EXPECT_EQ(reader.damages(), std::vector<std::string>{});
  EXPECT_TRUE(reader.attachments().empty());
}

TEST(McapFileWriter, ASmallDiskLeavesAFileOfWholeChunks) {
  // A file system of 256 KiB in a name space of this test's own.
  const SmallDisk disk(256 << 10);
  if (!disk.mounted()) GTEST_SKIP() << "NOT TESTED: full disks: may not mount one";
  const std::string path = disk.path() + "/a.mcap";
  FileWriter writer;
  ASSERT_TRUE(writer.open(path, sample_topics()));
  ChunkBuilder builder;
  const std::vector<std::uint8_t> data(10'000, 7);
  int chunks = 0;
  for (bool written = true; written && chunks < 100; chunks += written) {
    for (std::uint32_t i = 0; i < 5; ++i) builder.add(1, i, static_cast<std::uint64_t>(chunks), 0, data);
    written = writer.append(builder.finish({}));
  }
  EXPECT_EQ(chunks, 5);
  EXPECT_EQ(writer.error(), ENOSPC);
  EXPECT_EQ(writer.bytes(), std::filesystem::file_size(path));
  {
    Reader reader(path);
    EXPECT_EQ(read_all(reader).size(), 25u);
    EXPECT_EQ(reader.damages(), std::vector<std::string>{});
  }
  FileWriter second;
  std::ofstream(disk.path() + "/filler") << std::string(1 << 20, 'x');
  EXPECT_FALSE(second.open(disk.path() + "/b.mcap", sample_topics()));
  EXPECT_EQ(second.error(), ENOSPC);
  EXPECT_FALSE(std::filesystem::exists(disk.path() + "/b.mcap")) << "an empty file is left";
  while (writer.note({"fills the last page", {}})) {
  }
  // The summary does not fit either; what is there stays readable.
  EXPECT_FALSE(writer.close());
  Reader reader(path);
  EXPECT_EQ(read_all(reader).size(), 25u);
  EXPECT_FALSE(reader.complete());
}

}  // namespace
}  // namespace knuckle::mcap
