// The seconds before and after each stop are kept, whether or not the session is recorded.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "recording/recording.h"
#include "recording/tapped_wires.h"
#include "tests/recording/recorded_session.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {

using recording::Recorder;
using recording::RecorderOptions;
using recording::RecorderStatus;
using recording::Recording;

TEST(FlightRecorder, EveryStopLeavesTheSecondsBeforeAndAfterItAlsoWithoutARecording) {
  TemporaryFolder folder;
  RecorderOptions how = into(folder.path().string());
  how.keep = false;
  const RecorderStatus status = record(short_session("link_faults", 60), how);
  EXPECT_TRUE(paths_in(folder.path().string(), false).empty());
  const auto flights = paths_in(folder.path().string(), true);
  ASSERT_GE(flights.size(), 1u);
  EXPECT_EQ(flights.size(), status.flights.size());
  for (const std::string& file : flights) {
    Recording recording({file});
    EXPECT_EQ(recording.head().part, 0);
    const auto span = recording.span();
    ASSERT_TRUE(span);
    const double stopped_s = std::stod(std::filesystem::path(file).filename().string());
    EXPECT_LE(to_seconds(span->first), std::max(0.1, stopped_s - 29.5)) << file;
    EXPECT_GE(to_seconds(span->last), std::min(stopped_s + 5, 60.0) - 0.6) << file;
    EXPECT_THROW((void)replayed({file}), InputError);
  }
}

TEST(FlightRecorder, SecondSessionOfTheSameNameKeepsBoth) {
  TemporaryFolder folder;
  RecorderOptions how = into(folder.path().string());
  how.keep = false;
  for (int i = 0; i < 2; ++i) {
    const RecorderStatus status = record(short_session("fault_in_contact", 60), how);
    EXPECT_EQ(status.flights.size(), 1u);
  }
  EXPECT_EQ(paths_in(folder.path().string(), true).size(), 2u);
}

TEST(FlightRecorder, FaultThatComesAndGoesGetsNoMoreThanItsShareOfTheFolder) {
  TemporaryFolder folder;
  RecorderOptions how = into(folder.path().string());
  how.keep = false;
  const session::LoadedSession loaded = session::load_session(short_session("free_motion", 1));
  Recorder recorder(how, session::session_head(loaded.setup, {}), loaded.setup.machine);
  recording::LoopTap tap;
  tap.record_to(recorder.machine_steps());
  constexpr int kMost = recording::FlightRecorder::kMostPerHour;
  const auto fault_at = [&](Duration at) {
    tap.end_step(Time(at), ReasonCode::kEmergencyStop);
    recorder.drain();
    for (const Duration later : {1s, 7s}) {
      tap.end_step(Time(at + later), ReasonCode::kNone);
      recorder.drain();
    }
  };
  for (int i = 0; i < kMost + 3; ++i) fault_at(i * 90s);
  EXPECT_EQ(recorder.status().notices.size(), 3u);
  fault_at(std::chrono::hours(1) + 5s);  // the first of the hour before counts no more
  recorder.close();
  EXPECT_EQ(recorder.status().flights.size(), kMost + 1u);
}

TEST(FlightRecorder, OneThatCannotBeWrittenIsToldWithItsReason) {
  TemporaryFolder folder;
  std::ofstream(folder.file("file")) << "x";
  RecorderOptions how = into(folder.file("file") + "/inside");
  how.keep = false;
  const RecorderStatus status = record(short_session("fault_in_contact", 60), how);
  EXPECT_TRUE(status.flights.empty());
  ASSERT_GE(status.notices.size(), 2u);  // at the start, and whenever one was needed
  for (const std::string& notice : status.notices)
    EXPECT_NE(notice.find("Not a directory"), std::string::npos) << notice;
}

TEST(FlightRecorder, NamesTheReason) {
  TemporaryFolder folder;
  RecorderOptions how = into(folder.path().string());
  how.keep = false;
  (void)record(short_session("fault_in_contact", 60), how);
  const auto flights = paths_in(folder.path().string(), true);
  ASSERT_EQ(flights.size(), 1u);
  EXPECT_NE(flights[0].find("_simulate_link_lost.mcap"), std::string::npos) << flights[0];
}

}  // namespace
}  // namespace knuckle::test
