// Ctrl+C of `knuckle commission`: as the program that is shipped, on the simulated machine.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "app/session/frame_log.h"
#include "recording/events.h"
#include "recording/file_names.h"
#include "recording/recording.h"
#include "recording/wire_events.h"
#include "tests/bringup/commission_script.h"
#include "tests/bringup/hardware_bench.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::bringup {
namespace {

namespace fs = std::filesystem;
using recording::WireEventKind;
using namespace std::chrono_literals;

class InterruptedCommission : public testing::Test {
 protected:
  /// In a dialogue through a pipe, up to the end of the fifth step; interrupted once it has said what is awaited.
  void interrupt(const std::vector<std::string>& more_words, const std::string& awaited) {
    const std::string fifo = folder_.file("typed"), said = folder_.file("said");
    fs::create_directory(log());
    ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
    knuckle::test::RunningProgram commission("/bin/sh", {"-c", "exec " + command() + " < " + fifo + " > " + said});
    std::ofstream typed(fifo);
    test::Script words = test::all();
    words.resize(test::kStroked);
    for (const std::string& word : words) typed << word << '\n';
    for (const std::string& word : more_words) typed << word << '\n';
    typed.flush();
    const auto has_said = [&] { return knuckle::test::content(said).find(awaited) != std::string::npos; };
    for (int i = 0; i < 6000 && !has_said(); ++i) std::this_thread::sleep_for(10ms);
    ASSERT_TRUE(has_said()) << knuckle::test::content(said);
    commission.signal(SIGINT);
    ASSERT_TRUE(commission.ends_within(60s));
    ended_ = commission.wait();
  }
  [[nodiscard]] std::string command() const {
    return knuckle::test::program("knuckle") + " commission --simulate --machine solar015 --seed 7 --out " + out() +
           " --record " + folder_.path().string() + " --log " + log();
  }
  [[nodiscard]] std::string out() const { return folder_.file("found.toml"); }
  [[nodiscard]] std::string log() const { return folder_.file("log"); }

  knuckle::test::TemporaryFolder folder_;
  knuckle::test::ProgramRun ended_;
};

struct Interrupted {
  session::FrameLog sent_and_received;
  std::string last_event;
  bool complete = false;
};
Interrupted interrupted_in(const std::string& folder) {
  Interrupted all;
  const auto files = recording::files_in(folder);
  EXPECT_EQ(files.size(), 1u);
  if (files.size() != 1) return all;
  recording::Recording recording({files.front().path});
  while (const auto entry = recording.next()) {
    if (entry->topic == recording::Topic::kEvents)
      all.last_event = recording::decode_log(entry->data, recording.head().started_unix_ns).value().text;
    if (entry->topic != recording::Topic::kMachineWires) continue;
    const auto wires = recording::decode_wires(entry->data, kLinkVersion);
    for (const recording::WireEvent& event : wires->events)
      if (event.kind == WireEventKind::kCanSent || event.kind == WireEventKind::kCanReceived)
        all.sent_and_received.push_back({wires->at, recording::can_frame(event)});
  }
  all.complete = recording.complete();
  return all;
}

TEST_F(InterruptedCommission, LeavesNothingHalfWrittenAClosedRecordingAndANeutralMachine) {
  ASSERT_NO_FATAL_FAILURE(interrupt({}, "\n6. "));
  EXPECT_EQ(ended_.exit_code, 130);
  EXPECT_NE(ended_.err.find("interrupted; nothing was written to " + out()), std::string::npos) << ended_.err;
  EXPECT_NE(ended_.err.find("steps up to 5 are kept in"), std::string::npos) << ended_.err;
  EXPECT_FALSE(fs::exists(out()));
  for (const auto& file : fs::recursive_directory_iterator(folder_.path()))
    EXPECT_EQ(file.path().string().find(".partial"), std::string::npos) << file.path();
  const Interrupted recorded = interrupted_in(log());
  EXPECT_TRUE(recorded.complete);
  EXPECT_EQ(recorded.last_event, "interrupted; the machine is neutral");
  ASSERT_FALSE(recorded.sent_and_received.empty());
  const Time end = recorded.sent_and_received.back().at + 1ms;
  EXPECT_TRUE(session::neutral_times(recorded.sent_and_received, test::solar(), end - 1ms, end).command);
}

TEST_F(InterruptedCommission, IsThatInTheMidstOfAMotionToo) {
  ASSERT_NO_FATAL_FAILURE(interrupt({"go"}, "\n6. "));  // the first ramp, or the question after it
  EXPECT_EQ(ended_.exit_code, 130);
  EXPECT_FALSE(fs::exists(out()));
  const Interrupted recorded = interrupted_in(log());
  EXPECT_TRUE(recorded.complete);
  const Time end = recorded.sent_and_received.back().at + 1ms;
  EXPECT_TRUE(session::neutral_times(recorded.sent_and_received, test::solar(), end - 1ms, end).command);
}

TEST_F(InterruptedCommission, GoesOnWithWhatItHasKept) {
  ASSERT_NO_FATAL_FAILURE(interrupt({}, "\n6. "));
  const knuckle::test::ProgramRun resumed =
      knuckle::test::run_program("/bin/sh", {"-c", command() + " --resume < /dev/null"});
  EXPECT_NE(resumed.out.find("Goes on after step 5 of the run before"), std::string::npos)
      << resumed.out << resumed.err;
}

}  // namespace
}  // namespace knuckle::bringup
