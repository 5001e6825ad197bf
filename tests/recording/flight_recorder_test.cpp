// The seconds before and after each stop are kept, whether or not the session is recorded.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "recording/recording.h"
#include "recording/tapped_wires.h"
#include "tests/recording/recorded_session.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
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

/// A machine's side that only stops, and keeps flight records alone.
class Stopping {
 public:
  explicit Stopping(RecorderOptions how) : recorder_(flights_alone(std::move(how)), head_, loaded_.setup.machine) {
    tap_.record_to(recorder_.machine_steps());
  }
  void fault_at(Duration at, ReasonCode why) {
    step(at, why);
    for (const Duration later : {1s, 7s}) step(at + later, ReasonCode::kNone);
  }
  /// At the session's end.
  RecorderStatus status() {
    recorder_.close();
    return recorder_.status();
  }

 private:
  static RecorderOptions flights_alone(RecorderOptions how) {
    how.keep = false;
    return how;
  }
  void step(Duration at, ReasonCode alarm) {
    tap_.end_step(Time(at), alarm);
    recorder_.drain();
  }
  session::LoadedSession loaded_ = session::load_session(short_session("free_motion", 1));
  recording::Head head_ = session::session_head(loaded_.setup, {});
  Recorder recorder_;
  recording::LoopTap tap_;
};

TEST(FlightRecorder, IsNamedByTheReasonAndASecondSessionKeepsBoth) {
  TemporaryFolder folder;
  for (int i = 0; i < 2; ++i) {
    Stopping session(into(folder.path().string()));
    session.fault_at(10s, ReasonCode::kLinkLost);
    EXPECT_EQ(session.status().flights.size(), 1u);
  }
  const auto flights = paths_in(folder.path().string(), true);
  ASSERT_EQ(flights.size(), 2u);
  EXPECT_TRUE(says(flights[0], "_simulate_link_lost"));
}

TEST(FlightRecorder, IsNoPartOfARecordingWhicheverIsNamedFirst) {
  TemporaryFolder folder;
  Stopping session(into(folder.path().string()));
  session.fault_at(10s, ReasonCode::kLinkLost);
  ASSERT_EQ(session.status().flights.size(), 1u);
  const std::string flight = paths_in(folder.path().string(), true).at(0);
  RecorderOptions how = into("");
  how.file = folder.file("whole.mcap");
  (void)record(short_session("free_motion", 0.5), how);
  for (const std::vector<std::string>& files : {std::vector{flight, how.file}, std::vector{how.file, flight}})
    EXPECT_EQ(refusal([&] { return Recording(files).complete(); }), flight + ": is a flight record: name it alone");
}

TEST(FlightRecorder, FaultThatComesAndGoesGetsNoMoreThanItsShareOfTheFolder) {
  TemporaryFolder folder;
  Stopping session(into(folder.path().string()));
  constexpr int kMost = recording::FlightRecorder::kMostPerHour;
  for (int i = 0; i < kMost + 3; ++i) session.fault_at(i * 90s, ReasonCode::kEmergencyStop);
  session.fault_at(std::chrono::hours(1) + 5s, ReasonCode::kEmergencyStop);  // the first one of all counts no more
  const RecorderStatus status = session.status();
  EXPECT_EQ(status.notices.size(), 3u);
  EXPECT_EQ(status.flights.size(), kMost + 1u);
}

TEST(FlightRecorder, OneThatCannotBeWrittenIsToldWithItsReason) {
  TemporaryFolder folder;
  std::ofstream(folder.file("file")) << "x";
  Stopping session(into(folder.file("file") + "/inside"));
  session.fault_at(10s, ReasonCode::kLinkLost);
  const RecorderStatus status = session.status();
  EXPECT_TRUE(status.flights.empty());
  ASSERT_GE(status.notices.size(), 2u);  // at the start, and when one was needed
  for (const std::string& notice : status.notices) EXPECT_TRUE(says(notice, "Not a directory"));
}

}  // namespace
}  // namespace knuckle::test
