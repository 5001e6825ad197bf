// What is read of recordings for the player, and what is refused in one line.
#include "machine/load.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "app/console/machine_text.h"
#include "app/console/player/load.h"
#include "app/recordings/import.h"
#include "core/error.h"
#include "machine/kinematics.h"
#include "recording/events.h"
#include "tests/console/player/played_files.h"
#include "tests/recording/recorded_session.h"
#include "tests/recording/rewrite.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::test {
namespace {

namespace player = console::player;

void expect_refused(const std::string& file, const std::string& because) {
  const std::string said = refusal([&] { return player::load({file}); });
  EXPECT_TRUE(says(said, because));
  EXPECT_FALSE(says(said, "\n"));
}

const console::EventRow* first_of(const player::Played& played, const std::string& code) {
  const auto row = std::find_if(played.events.begin(), played.events.end(),
                                [&](const console::EventRow& e) { return e.code == code; });
  return row == played.events.end() ? nullptr : &*row;
}

TEST(PlayedFile, BringsItsOwnMachineAndSurroundings) {
  const player::Played played = player::load({recorded("press")});
  EXPECT_EQ(played.machine.name, "solar015");
  ASSERT_TRUE(played.device);
  ASSERT_TRUE(played.world);
  EXPECT_EQ(played.world->walls.size(), 1u);
  EXPECT_TRUE(played.notes.empty());
}

TEST(PlayedFile, WhoseProgramToldNothingHasTheEventsThatTheConsoleWouldHaveListed) {
  const player::Played played = player::load({recorded("lost_link")});
  const console::EventRow* fault = first_of(played, "link_lost");
  ASSERT_NE(fault, nullptr);
  EXPECT_EQ(fault->severity, console::Severity::kAlarm);
  Time faulted = kNever;
  for_each_state<master::MasterState>(recorded("lost_link"), recording::Topic::kOperatorState, [&](const auto& state) {
    if (state.fault && faulted == kNever) faulted = state.at;
  });
  EXPECT_EQ(fault->at, faulted) << "in the very step";
  ASSERT_NE(first_of(player::load({recorded("press")}), "contact"), nullptr);
}

TEST(PlayedFile, WhoseWiresWereAlteredShowsNothingOfThemAndSaysSo) {
  const TemporaryFolder folder;
  bool altered = false;
  const std::string file = edited(folder, "press", [&](const std::string& topic, std::vector<std::uint8_t>& message) {
    if (altered || topic != "/operator/wires") return true;
    auto wires = recording::decode_wires(message, kLinkVersion);
    for (recording::WireEvent& event : wires->events) {
      if (event.kind != recording::WireEventKind::kLinkReceived) continue;
      std::vector<std::uint8_t> bytes(event.data.begin(), event.data.end());
      bytes.back() ^= 1;
      event.data = bytes;
      message = encode_wires(*wires, false);
      altered = true;
      break;
    }
    return true;
  });
  ASSERT_TRUE(altered);
  const player::Played played = player::load({file});
  ASSERT_EQ(played.notes.size(), 1u);
  EXPECT_TRUE(says(played.notes[0], "steps whose wires were changed after they were recorded, and are left out: 1"));
}

/// A copy of "press". @param after called behind every message, may put in more or close the chunk.
template <typename After>
void copy_press(const std::string& file, const After& after) {
  mcap::Reader from(recorded("press"));
  mcap::FileWriter to;
  const recording::Head head = head_of(recorded("press"));
  ASSERT_TRUE(to.open(file, from.topics()));
  ASSERT_TRUE(to.note(metadata_of(head)));
  for (const mcap::Attachment& attachment : attachments_of(head)) ASSERT_TRUE(to.attach(attachment));
  mcap::ChunkBuilder chunk;
  while (const auto message = from.next()) {
    chunk.add(message->channel_id, message->sequence, message->log_time_ns, message->publish_time_ns, message->data);
    after(chunk, to);
  }
  ASSERT_TRUE(to.append(chunk.finish({1})));
  ASSERT_TRUE(to.close());
}

TEST(PlayedFile, WithEventsOfItsProgramHasThese) {
  const TemporaryFolder folder;
  const std::string file = folder.file("told.mcap");
  bool first = true;
  copy_press(file, [&](mcap::ChunkBuilder& chunk, mcap::FileWriter&) {
    if (!std::exchange(first, false)) return;
    const auto log = recording::encode_log({Time(700ms), recording::Severity::kInfo, "mode", "said so"},
                                           head_of(recorded("press")).started_unix_ns);
    chunk.add(recording::channel_of(recording::Topic::kEvents), 0, 700'000'000, 700'000'000, log);
  });
  const player::Played played = player::load({file});
  ASSERT_NE(first_of(played, "mode"), nullptr);
  EXPECT_EQ(first_of(played, "mode")->text, "said so");
  EXPECT_EQ(std::count_if(played.events.begin(), played.events.end(), [](const auto& e) { return e.code == "mode"; }),
            1);
  EXPECT_NE(first_of(played, "contact"), nullptr) << "of which the program said nothing";
}

TEST(PlayedFile, ThatWasCutOffIsPlayedAsFarAsItGoes) {
  const TemporaryFolder folder;
  const std::string whole = folder.file("whole.mcap"), cut = folder.file("cut.mcap");
  // Small chunks, as of a session that is recorded while it runs.
  copy_press(whole, [](mcap::ChunkBuilder& chunk, mcap::FileWriter& to) {
    if (chunk.bytes() <= 200'000) return;
    ASSERT_TRUE(to.append(chunk.finish({1})));
  });
  std::filesystem::copy_file(whole, cut);
  std::filesystem::resize_file(cut, std::filesystem::file_size(whole) * 6 / 10);
  const player::Played played = player::load({cut});
  EXPECT_FALSE(played.notes.empty());
  EXPECT_FALSE(played.run.empty());
  EXPECT_LT(played.run.last(), player::load({whole}).run.last());
}

/// A state of the machine's side with another time.
std::vector<std::uint8_t> at_time(const std::vector<std::uint8_t>& message, Time at) {
  slave::SlaveState state;
  if (!recording::decode(message, state)) return message;
  state.at = at;
  std::vector<std::uint8_t> room(message.size() + 64);
  recording::CdrWriter out(room);
  recording::put(out, state);
  room.resize(out.size());
  return room;
}

TEST(PlayedFile, IsRefusedInOneLineWhereThereIsNothingToPlay) {
  const TemporaryFolder folder;
  const std::string no_mcap = folder.file("text.mcap");
  expect_refused(edited(folder, "press", [](const auto&, auto&) { return false; }), "holds no step of a loop");
  std::ofstream(no_mcap) << "no recording";
  expect_refused(no_mcap, "text.mcap");
  std::ofstream(folder.file("nothing.mcap"));
  expect_refused(folder.file("nothing.mcap"), "nothing.mcap");
  expect_refused(folder.file("absent.mcap"), "absent.mcap");
  const std::string other = edited(folder, "press", [](const std::string& topic, std::vector<std::uint8_t>& message) {
    if (topic == "/machine/state") message.push_back(0);
    return true;
  });
  expect_refused(other, "/machine/state at 0.005 s: is no state: damaged, or of another version");
  recording::Head head = head_of(recorded("press"));
  head.machine_file.clear();
  expect_refused(edited(folder, "press", head), "machine.toml: is missing");
  const auto endless = [](const std::string& topic, std::vector<std::uint8_t>& message) {
    if (topic == "/machine/state") message = at_time(message, Time(Duration::max()));
    return true;
  };
  expect_refused(edited(folder, "load", endless), "at most 72 h of a session can be played");
}

/// A table of two seconds, without commands, that has a hole from 1 s on. At its start and at 0.5 s, the arm's cylinder
/// is longer for 0.05 s than any angle makes it.
std::string imported_table(const TemporaryFolder& folder) {
  recordings::RecordedFile table;
  table.recording.source = "table.csv";
  table.recording.step_s = 0.01;
  table.notes = {"read"};
  const recording::Head head = head_of(recorded("press"));
  const MachineDescription machine = parse_machine(head.machine_file, "machine");
  const Kinematics kinematics(machine);
  estimation::Measurement sample;
  sample.pressure_Pa.fill(5e6);
  for (int j = 0; j < kJoints; ++j) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(j)];
    sample.cylinder_m[j] = kinematics.cylinder_at(j, (link.min_rad + link.max_rad) / 2)->length_m;
  }
  table.recording.samples.assign(200, sample);
  table.recording.usable.assign(200, 1);
  std::fill(table.recording.usable.begin() + 100, table.recording.usable.end(), std::uint8_t{0});
  for (const std::size_t from : {0U, 50U})
    for (std::size_t i = from; i < from + 5; ++i) table.recording.samples[i].cylinder_m[kArm] = 3;
  for (std::size_t i = 0; i < 200; ++i) table.rows.push_back(i + 2);
  recording::Head own;
  own.program = "knuckle import";
  own.machine_file = head.machine_file;
  const std::string file = folder.file("table.mcap");
  (void)recordings::write_imported(table, own, machine, file);
  return file;
}

TEST(PlayedFile, OfATableShowsItsSensorsAlsoWhereNoAngleIsKnownAndOfAllElseThatItIsUnknown) {
  const TemporaryFolder folder;
  const player::Played played = player::load({imported_table(folder)});
  const console::ConsoleView view = played.run.view(Time(400ms)), hole = played.run.view(Time(1500ms));
  EXPECT_TRUE(view.sensors_alone);
  EXPECT_EQ(view.machine.pressure_Pa[0], 5e6);
  EXPECT_TRUE(view.machine.position_rad.allFinite());
  const console::ConsoleView no_angle = played.run.view(Time(520ms));
  EXPECT_EQ(no_angle.machine.pressure_Pa[0], 5e6);
  EXPECT_NE(no_angle.machine.sensor_at, kNever);
  EXPECT_EQ(no_angle.machine.position_rad, played.run.view(Time(490ms)).machine.position_rad) << "the pose is held";
  EXPECT_TRUE(played.run.view(Time(20ms)).machine.position_rad.allFinite());
  EXPECT_TRUE(std::isnan(hole.machine.pressure_Pa[0]));
  EXPECT_EQ(hole.machine.sensor_at, kNever);
  EXPECT_TRUE(played.run.modes().empty());
  for (const console::ConsoleView& v : {view, hole}) {
    const std::array unknown{v.machine.confidence,        v.machine.payload_kg,
                             v.machine.payload_sigma_kg,  v.machine.tip_force_N.x(),
                             v.machine.velocity_radps[0], v.status.valve_command[0],
                             v.status.spool[0],           v.hand.set_point_rad[0],
                             v.link.round_trip_s,         v.link.loss,
                             v.link.neutral_after_s};
    for (std::size_t i = 0; i < unknown.size(); ++i) EXPECT_TRUE(std::isnan(unknown[i])) << i << ": " << unknown[i];
    EXPECT_FALSE(v.status_of_steps);
    EXPECT_FALSE(console::force_text(v).known);
  }
  for (const console::EventRow& row : played.events) EXPECT_EQ(row.code, "import") << row.text;
}

TEST(PlayedFile, WithStepsOutOfOrderIsPlayedWithoutThem) {
  const TemporaryFolder folder;
  int step = 0;
  const std::string file = edited(folder, "load", [&](const std::string& topic, std::vector<std::uint8_t>& message) {
    if (topic == "/machine/state" && ++step % 100 == 0) message = at_time(message, Time(-1s));
    return true;
  });
  const player::Played played = player::load({file});
  const auto& rows = played.run.data().machine;
  EXPECT_EQ(rows.size(), 1030u);
  EXPECT_TRUE(std::is_sorted(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.at < b.at; }));
}

TEST(PlayedFlightRecord, ListsEachFaultOnceAndWhatComesAfterIt) {
  const TemporaryFolder folder;
  recording::RecorderOptions how;
  how.folder = folder.path().string();
  how.keep = false;
  const recording::RecorderStatus status = record(short_session("bus_faults", 20), how);
  ASSERT_EQ(status.flights.size(), 2u);
  const player::Played played = player::load({status.flights.back()});
  std::vector<std::string> codes;
  for (const console::EventRow& row : played.events)
    if (row.code != "recorder") codes.push_back(row.code);
  EXPECT_EQ(std::count(codes.begin(), codes.end(), "node_fault"), 1);
  EXPECT_EQ(std::count(codes.begin(), codes.end(), "node_emergency"), 1);
  const auto first = std::find(codes.begin(), codes.end(), "node_fault");
  EXPECT_NE(std::find(first, codes.end(), "mode"), codes.end()) << "it was led again in between";
}

TEST(Rerun, WithNothingChangedShowsTheSameInEveryStep) {
  const player::Played played = player::load({recorded("press")});
  const player::Rerun again = player::rerun({recorded("press")}, {}, played.run);
  recording::Recording plain({recorded("press")});
  if (!recording::replay(plain, recording::setup_of(plain)).identical())
    GTEST_SKIP() << "NOT TESTED: a rerun to the last bit: this processor's last bits differ (test_recording, Files/)";
  ASSERT_TRUE(again.result.identical()) << "although the plain replay is";
  for (Time at = played.run.first(); at <= played.run.last(); at += 1ms) {
    const console::ConsoleView a = played.run.view(at), b = again.run.view(at);
    ASSERT_EQ(a.link.heard, b.link.heard);
    ASSERT_EQ(a.machine.mode, b.machine.mode);
    ASSERT_TRUE(!a.link.heard || a.machine.tip_force_N == b.machine.tip_force_N);
    ASSERT_EQ(a.hand.set_point_rad, b.hand.set_point_rad);
    ASSERT_TRUE(!a.link.heard || a.status.valve_command == b.status.valve_command);
  }
}

TEST(Rerun, WithAChangedGainCommandsOtherwiseOnTheSameInput) {
  const TemporaryFolder folder;
  const player::Played played = player::load({recorded("press")});
  const player::Rerun again =
      player::rerun({recorded("press")}, {{slower_machine(folder, "press")}, "", ""}, played.run);
  const auto& first = again.result.sides[1].first;
  ASSERT_TRUE(first);
  double apart = 0, before = 0;
  for (Time at = played.run.first(); at <= played.run.last(); at += 5ms) {
    const console::ConsoleView a = played.run.view(at), b = again.run.view(at);
    const double differs = (a.status.valve_command - b.status.valve_command).norm();
    if (a.link.heard) (at < first->at ? before : apart) = std::max(at < first->at ? before : apart, differs);
    ASSERT_EQ(a.machine.position_rad, b.machine.position_rad) << "what was measured stays";
  }
  EXPECT_EQ(before, 0);
  EXPECT_GT(apart, 0.01);
}

TEST(Rerun, WithAnotherContactModelFeelsWhatThatTellsAndMovesAsRecorded) {
  const player::Played played = player::load({recorded("press")});
  const player::Rerun again = player::rerun({recorded("press")}, {{}, "", "tip_wrench"}, played.run);
  double apart_N = 0;
  for (Time at = played.run.first(); at <= played.run.last(); at += 5ms) {
    const console::ConsoleView a = played.run.view(at), b = again.run.view(at);
    apart_N = std::max(apart_N, (a.machine.tip_force_N - b.machine.tip_force_N).norm());
    ASSERT_EQ(a.machine.position_rad, b.machine.position_rad);
  }
  EXPECT_GT(apart_N, 1);
  recording::Recording press({recorded("press")});
  recording::ReplaySetup setup = recording::setup_of(press);
  EXPECT_THROW(replay::change(setup, {{}, "", "tip"}), InputError);
  replay::change(setup, {{"compact080", "knuckle1_compact080"}, "", ""});
  EXPECT_EQ(setup.machine.name, "compact080");
  EXPECT_TRUE(setup.device.source.ends_with("devices/knuckle1_compact080.toml")) << setup.device.source;
  EXPECT_TRUE(begins(refusal([&] {
                       replay::change(setup, {{"nosuch"}, "", ""});
                     }),
                     "--with: unknown machine 'nosuch': "));
}

TEST(Rerun, IsRefusedWhereTheLoopsDoNotBeginInTheRecording) {
  const TemporaryFolder folder;
  recording::Head head = head_of(recorded("press"));
  head.part = 0;
  const std::string flight = edited(folder, "press", head);
  const player::Played played = player::load({flight});
  EXPECT_FALSE(played.run.empty()) << "it is played";
  EXPECT_THROW((void)player::rerun({flight}, {}, played.run), InputError);
}

}  // namespace
}  // namespace knuckle::test
