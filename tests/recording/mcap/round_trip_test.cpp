// What was written is read again, whatever it is.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "recording/mcap/chunk.h"
#include "recording/mcap/file_writer.h"
#include "recording/mcap/reader.h"
#include "tests/recording/mcap/sample_file.h"
#include "tests/support/no_alloc.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::mcap {
namespace {

TEST(McapRoundTrip, HandsOutWhatWasWrittenInItsOrder) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const test::TemporaryFolder folder;
    const std::string path = folder.file("a.mcap");
    std::mt19937 random(seed);
    const Topics topics = sample_topics();
    FileWriter writer;
    ASSERT_TRUE(writer.open(path, topics));
    std::vector<Kept> expected;
    ChunkBuilder builder;
    Chunk chunk;
    for (int i = 0; i < 5; ++i) {
      const auto added = random_messages(random, 1 + random() % 200);
      for (const Kept& m : added) builder.add(m.channel_id, m.sequence, m.log_time_ns, m.publish_time_ns, m.data);
      expected.insert(expected.end(), added.begin(), added.end());
      const Compression compression =
          random() % 2 ? Compression{.zstd_level = static_cast<int>(random() % 8) - 4} : Compression{};
      chunk = builder.finish(compression, std::move(chunk));
      ASSERT_TRUE(writer.append(chunk));
    }
    ASSERT_TRUE(writer.close());

    std::stable_sort(expected.begin(), expected.end(),
                     [](const Kept& a, const Kept& b) { return a.log_time_ns < b.log_time_ns; });
    Reader reader(path);
    EXPECT_EQ(read_all(reader), expected);
    EXPECT_EQ(reader.damages(), std::vector<std::string>{});
    EXPECT_TRUE(reader.complete());
    EXPECT_EQ(reader.topics().schemas, topics.schemas);
    EXPECT_EQ(reader.topics().channels, topics.channels);
    EXPECT_EQ(reader.chunks(), 5u);
  }
}

TEST(McapRoundTrip, KeepsAttachmentsAndMetadata) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("a.mcap");
  const Attachment machine{"machine.toml", "application/toml", 17, 0, std::string("name = \"x\"\0y", 12)};
  const Metadata version{"software", {{"version", "0.1.0"}, {"compiler", "g++"}, {"empty", ""}}};
  const Metadata mark{"bookmark", {{"text", "bucket slipped"}}};
  {
    FileWriter writer;
    ASSERT_TRUE(writer.open(path, sample_topics()));
    ASSERT_TRUE(writer.attach(machine));
    ASSERT_TRUE(writer.note(version));
    ASSERT_TRUE(writer.append(sample_chunk(1)));
    ASSERT_TRUE(writer.note(mark));
  }  // closes
  Reader reader(path);
  ASSERT_EQ(reader.attachments().size(), 1u);
  const auto attachment = reader.read(reader.attachments()[0]);
  ASSERT_TRUE(attachment);
  EXPECT_EQ(attachment->name, machine.name);
  EXPECT_EQ(attachment->media_type, machine.media_type);
  EXPECT_EQ(attachment->log_time_ns, 17u);
  EXPECT_EQ(attachment->data, machine.data);
  EXPECT_EQ(reader.metadata(), (std::vector<Metadata>{version, mark}));
  EXPECT_EQ(reader.damages(), std::vector<std::string>{});
  EXPECT_TRUE(reader.complete());
  EXPECT_EQ(read_all(reader).size(), sample_messages(1).size());
}

TEST(McapRoundTrip, SeekSkipsWhatIsEarlierWithAndWithoutSummary) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("a.mcap");
  std::vector<Kept> all;
  {
    FileWriter writer;
    ASSERT_TRUE(writer.open(path, sample_topics()));
    for (std::uint32_t i = 0; i < 10; ++i) {
      ASSERT_TRUE(writer.append(sample_chunk(i)));
      const auto some = sample_messages(i);
      all.insert(all.end(), some.begin(), some.end());
    }
    std::filesystem::copy_file(path, folder.file("killed.mcap"));
  }
  for (const char* name : {"a.mcap", "killed.mcap"}) {
    Reader reader(folder.file(name));
    EXPECT_EQ(reader.complete(), name[0] == 'a');
    ASSERT_TRUE(reader.times());
    EXPECT_EQ(reader.times()->first_ns, all.front().log_time_ns);
    EXPECT_EQ(reader.times()->last_ns, all.back().log_time_ns);
    for (const std::uint64_t from : {std::uint64_t{0}, all[5].log_time_ns, all[all.size() / 2].log_time_ns,
                                     all.back().log_time_ns, all.back().log_time_ns + 1}) {
      reader.seek(from);
      std::vector<Kept> later;
      for (const auto& m : all)
        if (m.log_time_ns >= from) later.push_back(m);
      EXPECT_EQ(read_all(reader), later) << name << " from " << from;
    }
  }
}

TEST(McapRoundTrip, AllocatesNothingOnceItsBuffersHaveGrown) {
  ChunkBuilder builder;
  const auto messages = sample_messages(1);
  for (const Compression compression : {Compression{}, Compression{.zstd_level = -3}}) {
    Chunk chunk;
    const auto round = [&] {
      for (const Kept& m : messages) builder.add(m.channel_id, m.sequence, m.log_time_ns, m.publish_time_ns, m.data);
      chunk = builder.finish(compression, std::move(chunk));
    };
    for (int i = 0; i < 3; ++i) round();
    test::NoAllocScope scope;
    for (int i = 0; i < 10; ++i) round();
    EXPECT_EQ(scope.allocations(), 0u);
  }
}

}  // namespace
}  // namespace knuckle::mcap
