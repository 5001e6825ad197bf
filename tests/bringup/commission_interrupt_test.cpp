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
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/solar.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
namespace fs = std::filesystem;
using recording::WireEventKind;
using namespace std::chrono_literals;

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

TEST(InterruptedCommission, LeavesNothingHalfWrittenAClosedRecordingANeutralMachineAndProgressToGoOnFrom) {
  const knuckle::test::TemporaryFolder folder;
  const std::string fifo = folder.file("typed"), said = folder.file("said"), out = folder.file("found.toml"),
                    log = folder.file("log");
  fs::create_directory(log);
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  const std::string command = "exec " + knuckle::test::program("knuckle") +
                              " commission --simulate --machine solar015 --seed 7 --out " + out + " --record " +
                              folder.path().string();
  knuckle::test::RunningProgram commission("/bin/sh", {"-c", command + " --log " + log + " < " + fifo + " > " + said});
  std::ofstream typed(fifo);  // stays open: it waits for the next word
  for (const std::string& word : test::first_words(test::kStroked)) typed << word << std::endl;
  const auto has_said = [&] { return knuckle::test::content(said).find("\n6. ") != std::string::npos; };
  for (int i = 0; i < 6000 && !has_said(); ++i) std::this_thread::sleep_for(10ms);
  ASSERT_TRUE(has_said()) << knuckle::test::content(said);
  commission.signal(SIGINT);
  ASSERT_TRUE(commission.ends_within(60s));
  const knuckle::test::ProgramRun ended = commission.wait();
  EXPECT_EQ(ended.exit_code, 130);
  EXPECT_TRUE(says(ended.err, "interrupted; nothing was written to " + out));
  EXPECT_TRUE(says(ended.err, "steps up to 5 are kept in " + out + ".progress"));
  EXPECT_TRUE(fs::exists(out + ".progress"));
  EXPECT_FALSE(fs::exists(out));
  for (const auto& file : fs::recursive_directory_iterator(folder.path()))
    EXPECT_FALSE(says(file.path().string(), ".partial"));
  const Interrupted recorded = interrupted_in(log);
  EXPECT_TRUE(recorded.complete);
  EXPECT_EQ(recorded.last_event, "interrupted; the machine is neutral");
  ASSERT_FALSE(recorded.sent_and_received.empty());
  const Time end = recorded.sent_and_received.back().at + 1ms;
  EXPECT_TRUE(session::neutral_times(recorded.sent_and_received, knuckle::test::solar(), end - 1ms, end).command);
  const auto resumed = knuckle::test::run_program("/bin/sh", {"-c", command + " --resume < /dev/null"});
  EXPECT_TRUE(says(resumed.out, "Goes on after step 5 of the run before")) << resumed.err;
}

}  // namespace
}  // namespace knuckle::bringup
