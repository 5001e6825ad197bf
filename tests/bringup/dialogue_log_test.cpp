// What is recorded of a dialogue that moves a machine.
#include "app/bringup/dialogue_log.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <sstream>

#include "app/bringup/commission_jog.h"
#include "app/bringup/recover.h"
#include "core/error.h"
#include "recording/file_names.h"
#include "recording/recording.h"
#include "recording/replay.h"
#include "recording/wire_events.h"
#include "tests/bringup/hardware_bench.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "transport/canopen.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using recording::WireEventKind;
using test::simulated_bus;
using test::solar;

recording::Head head(bool simulated) {
  recording::Head head;
  head.program = "knuckle commission --can can0";
  head.simulated = simulated;
  head.machine_file = solar().text;
  return head;
}

/// The only recording in a folder.
std::string recording_in(const std::string& folder) {
  const auto files = recording::files_in(folder);
  EXPECT_EQ(files.size(), 1u);
  return files.empty() ? "" : files.front().path;
}

struct Recorded {
  std::size_t syncs = 0, received = 0;
  std::vector<std::string> events;
  std::set<std::string> kinds;
  std::size_t errors = 0;
};
Recorded read(const std::string& file) {
  Recorded all;
  recording::Recording recording({file});
  while (const auto entry = recording.next()) {
    if (entry->topic == recording::Topic::kEvents) {
      const auto event = recording::decode_log(entry->data, recording.head().started_unix_ns);
      all.events.push_back(event->text);
      all.kinds.insert(event->kind);
      if (event->severity == recording::Severity::kError) ++all.errors;
    }
    if (entry->topic != recording::Topic::kMachineWires) continue;
    const auto wires = recording::decode_wires(entry->data, kLinkVersion);
    for (const recording::WireEvent& event : wires->events) {
      all.syncs += event.kind == WireEventKind::kCanSent && event.value == canopen::kSyncId ? 1 : 0;
      all.received += event.kind == WireEventKind::kCanReceived ? 1 : 0;
    }
  }
  EXPECT_TRUE(recording.complete());
  return all;
}

/// A dialogue that is recorded, and a person who always says the same.
struct Logged {
  Logged(const char* kind, const char* answer, const std::shared_ptr<sim::MachineOnBus>& bus = simulated_bus())
      : log({folder.path().string(), false}, head(true), solar(), kind),
        access(log.tapped(sim::access_to(bus))),
        person(log.noted(terminal(
            told, [answer] { return std::optional<std::string>(answer); }, false))) {}
  [[nodiscard]] std::string file() const { return recording_in(folder.path().string()); }

  knuckle::test::TemporaryFolder folder;
  std::ostringstream told, said;
  DialogueLog log;
  BusAccess access;
  Partner person;
};

TEST(DialogueLog, HoldsEveryFrameOfTheBusAndWhatWasSaidAndAnswered) {
  const auto bus = simulated_bus();
  std::size_t syncs = 0;
  bus->bus().set_tap({[](void* count, Time, const CanFrame& frame) {
                        if (frame.id == canopen::kSyncId) ++*static_cast<std::size_t*>(count);
                      },
                      &syncs});
  Logged logged("commission", "go", bus);
  const auto work = [&] {
    JogBench bench(solar(), logged.access, [] { return false; });
    bench.start();
    bench.idle(20s);  // far longer than the ring of the steps has room for
    logged.person.begin(3, "dead bands");
    logged.person.say("boom: 4 %");
    logged.person.ask({"next", {"go", "stop"}, {}, ""});
    EXPECT_EQ(logged.person.poll(), "go");
    logged.access.bus().send({canopen::kSyncId, 0, {}});  // behind the last wait
    bus->advance(bus->now() + 10ms);                      // what was sent comes onto the bus
    throw CommissionEnded("a reason");
  };
  EXPECT_THROW(logged.log.run(logged.said, work), CommissionEnded);
  const std::string file = logged.file();
  EXPECT_EQ(logged.said.str(), "recorded in " + file + "\n");
  const Recorded recorded = read(file);
  EXPECT_GT(syncs, 4000u);
  EXPECT_EQ(recorded.syncs, syncs);
  EXPECT_GT(recorded.received, 10 * syncs);
  EXPECT_EQ(recorded.events,
            (std::vector<std::string>{"step 3: dead bands", "boom: 4 %", "next [go | stop]", "go", "a reason"}));
  EXPECT_EQ(recorded.errors, 1u) << "why it ended";
  EXPECT_TRUE(says(logged.told.str(), "boom: 4 %\n")) << "the person hears it all the same";
  recording::Recording again({file});
  EXPECT_THROW((void)recording::replay(again, {}), InputError) << "no loop ran";
}

TEST(DialogueLog, TellsWhatLedTheMachine) {
  Logged logged("recover", "no");
  const auto work = [&] { recover(solar(), kBoom, logged.access, logged.person, [] {}); };
  EXPECT_THROW(logged.log.run(logged.said, work), CommissionEnded);
  const Recorded recorded = read(logged.file());
  EXPECT_GT(recorded.received, 0u) << "the bus was listened to";
  EXPECT_EQ(recorded.kinds, (std::set<std::string>{"recover", "question", "answer"})) << logged.told.str();
  EXPECT_EQ(recorded.errors, 1u) << "why it ended";
}

TEST(DialogueLog, TellsAPersonAtTheNextQuestionThatTheDiskHasEndedIt) {
  Logged logged("commission", "go");
  const Partner& person = logged.person;
  const auto times_told = [&logged] {
    const std::string all = logged.told.str();
    std::size_t count = 0;
    for (std::size_t at = all.find("the recording has ended: "); at != std::string::npos;
         at = all.find("the recording has ended: ", at + 1))
      ++count;
    return count;
  };
  logged.log.run(logged.said, [&] {
    JogBench bench(solar(), logged.access, [] { return false; });
    bench.start();
    {
      const knuckle::test::FileSizeLimit limit(100'000);
      bench.idle(20s);
    }
    EXPECT_EQ(times_told(), 0u) << "not while something may move";
    person.ask({"next", {"go", "stop"}, {}, ""});
    EXPECT_EQ(times_told(), 1u) << logged.told.str();
    bench.idle(1s);
    person.ask({"next", {"go", "stop"}, {}, ""});
    EXPECT_EQ(times_told(), 1u) << "once";
    EXPECT_EQ(person.poll(), "go") << "the commissioning goes on";
  });
  EXPECT_FALSE(says(logged.said.str(), "the recording has ended"));
}

TEST(DialogueLog, IsOnWhereSomethingRealIsMovedUnlessTurnedOffAndSaysSo) {
  const knuckle::test::TemporaryFolder folder;
  setenv("KNUCKLE_RECORDINGS", folder.path().c_str(), 1);
  const auto notes = [](bool off, bool simulated) {
    DialogueLog log({"", off}, head(simulated), solar(), "commission");
    return log.notes();
  };
  EXPECT_EQ(notes(true, false), std::vector<std::string>{"NOT RECORDED (--no-log)"});
  EXPECT_TRUE(notes(false, true).empty());
  EXPECT_TRUE(recording::files_in(folder.path().string()).empty());
  const std::vector<std::string> on = notes(false, false);
  setenv("KNUCKLE_RECORDINGS", "/dev/null/log", 1);
  const std::vector<std::string> refused = notes(false, false);
  unsetenv("KNUCKLE_RECORDINGS");
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_TRUE(says(refused[0], "NOT RECORDED: KNUCKLE_RECORDINGS=/dev/null/log: cannot be written: "));
  ASSERT_EQ(on.size(), 1u);
  EXPECT_EQ(on[0], "recording to " + recording_in(folder.path().string()));
}

}  // namespace
}  // namespace knuckle::bringup
