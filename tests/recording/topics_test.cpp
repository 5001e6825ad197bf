#include "recording/topics.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

#include "machine/load.h"
#include "recording/events.h"
#include "recording/mcap/reader.h"
#include "tests/recording/recorded_session.h"
#include "tests/recording/ros2_message.h"
#include "tests/support/patterns.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::recording {
namespace {

TEST(Topics, EachIsCdrWithASchemaThatDefinesAllThatIsInItByNamesThatRos2Allows) {
  const std::set<std::string> built_in{"bool",  "uint8", "uint16", "uint32",  "uint64",
                                       "int32", "int64", "string", "float32", "float64"};
  const mcap::Topics all = topics();
  ASSERT_EQ(all.channels.size(), kTopicNames.size());
  for (const auto& [id, channel] : all.channels) {
    EXPECT_EQ(channel.message_encoding, "cdr");
    const mcap::Schema& own = all.schemas.at(channel.schema_id);
    EXPECT_EQ(own.encoding, "ros2msg");
    const test::Ros2Schema schema(own.data);
    std::set<std::string> used;
    for (const auto& [message, fields] : schema.messages()) {
      EXPECT_FALSE(fields.empty()) << own.name << ": " << message;
      std::set<std::string> names;
      for (const auto& field : fields) {
        if (!built_in.contains(field.type)) used.insert(field.type);
        // Foxglove reads no message of a schema with another name in it.
        EXPECT_TRUE(test::has_match(field.name, "^[a-z](_?[a-z0-9]+)*$")) << own.name << ": " << field.name;
        EXPECT_TRUE(names.insert(field.name).second) << own.name << ": " << message << ": " << field.name << " twice";
      }
    }
    for (const auto& [message, fields] : schema.messages()) {
      EXPECT_TRUE(message.empty() || used.contains(message)) << own.name << " defines " << message << " and has none";
    }
    for (const std::string& message : used) {
      EXPECT_TRUE(schema.messages().contains(message)) << own.name << " does not define " << message;
    }
  }
}

TEST(Topics, EveryMessageInAFileEndsWithTheLastFieldOfItsSchemaThere) {
  test::TemporaryFolder folder;
  RecorderOptions how;
  how.file = folder.file("session.mcap");
  test::record(test::short_session("free_motion", 3), how);
  mcap::Reader file(how.file);
  std::map<std::string, int> messages;
  std::map<std::uint16_t, test::Ros2Schema> schemas;
  while (const auto message = file.next()) {
    const mcap::Channel& channel = file.topics().channels.at(message->channel_id);
    const auto schema = schemas.try_emplace(channel.schema_id, file.topics().schemas.at(channel.schema_id).data).first;
    EXPECT_NO_THROW(test::Ros2Message(schema->second, message->data)) << channel.topic;
    ++messages[channel.topic];
  }
  EXPECT_EQ(messages["/operator/state"], 3000);
  EXPECT_EQ(messages["/machine/state"], 600);
  EXPECT_GE(messages["/tf"], 65) << "25 a second, once all sensors have been heard";
  EXPECT_LE(messages["/tf"], 75);
  EXPECT_EQ(messages["/scene"], messages["/tf"]);
  EXPECT_EQ(messages["/scene/machine"], 3);
}

/// What there is in a file into which one camera() was recorded.
template <typename OfCamera>
std::vector<std::uint8_t> recorded(const OfCamera& one, Topic topic, std::int64_t unix_ns) {
  const test::TemporaryFolder folder;
  RecorderOptions how;
  how.file = folder.file("camera.mcap");
  Head head;
  head.program = "knuckle console";
  head.started_unix_ns = unix_ns;
  {
    Recorder recorder(how, head, load_machine(test::source_dir() + "/config/machines/solar015.toml"));
    recorder.camera(one);
  }
  Recording file({how.file});
  const auto entry = file.next();
  if (!entry) return {};
  EXPECT_EQ(entry->topic, topic);
  EXPECT_EQ(entry->at, one.at);
  std::vector<std::uint8_t> message(entry->data.begin(), entry->data.end());
  EXPECT_FALSE(file.next());
  return message;
}

TEST(Topics, StampsOfCamerasAreReadAsTheyWereWritten) {
  const CameraStamp stamp{Time(1500ms), "mast", 12, 2, true, Time(9000s), Time(1480ms), 0.02};
  const std::vector<std::uint8_t> message = recorded(stamp, Topic::kCameraStamps, 0);
  const test::Ros2Schema schema(camera_stamp_schema());
  const test::Ros2Message again(schema, message);
  EXPECT_EQ(again.text("camera"), stamp.camera);
  const std::array read{again.number("time_ns"),       again.number("number"),      again.number("connection"),
                        again.number("senders_clock"), again.number("captured_ns"), again.number("received_ns"),
                        again.number("age_s")};
  EXPECT_EQ(read, (std::array{1.5e9, 12.0, 2.0, 1.0, 9e12, 1.48e9, 0.02}));
}

TEST(Topics, PicturesOfCamerasAreReadAsTheyWereWritten) {
  constexpr std::int64_t kBegan_unix_ns = 1'700'000'000'250'000'000;
  const CameraPicture picture{Time(1500ms), "mast", {0xff, 0xd8, 0, 7, 0xff, 0xd9}};
  const std::vector<std::uint8_t> message = recorded(picture, Topic::kCameraPictures, kBegan_unix_ns);
  const test::Ros2Schema schema(foxglove_schema(kPictureSchemaName));
  const test::Ros2Message again(schema, message);
  EXPECT_EQ(again.text("frame_id"), "mast");
  EXPECT_EQ(again.text("format"), "jpeg");
  EXPECT_EQ(again.number("timestamp.sec"), 1'700'000'001);
  EXPECT_EQ(again.number("timestamp.nanosec"), 750'000'000);
  const auto decoded = decode_camera_picture(message, kBegan_unix_ns);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->at, picture.at);
  EXPECT_EQ(decoded->camera, picture.camera);
  EXPECT_EQ(decoded->jpeg, picture.jpeg);
  for (std::size_t size = 0; size < message.size(); ++size)
    EXPECT_FALSE(decode_camera_picture(std::span(message).first(size), 0)) << size;
}

}  // namespace
}  // namespace knuckle::recording
