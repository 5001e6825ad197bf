// What explain says of recordings in which one thing was broken: the cause, when it began, and what is not claimed.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/explain/cause.h"
#include "app/explain/evidence.h"
#include "app/explain/timeline.h"
#include "core/units.h"
#include "machine/bus_frames.h"
#include "machine/load.h"
#include "machine/reason_text.h"
#include "master/master_state.h"
#include "recording/loop_tap.h"
#include "recording/recorder.h"
#include "slave/slave_state.h"
#include "tests/explain/faulted_session.h"
#include "tests/support/few_nodes.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::explain {
namespace {

using recording::WireEventKind;
using test::says;

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

/// Of a session of its own.
class Explained {
 public:
  explicit Explained(const std::string& fault, double after_s = 1.3, double length_s = 2) {
    record_session(faulted_scenario(fault, after_s, length_s), file());
    report = of(file());
  }
  static Report of(const std::string& file, Sides sides = {}) {
    recording::Recording recording({file});
    return report_on(recording, sides);
  }
  [[nodiscard]] std::string file() const { return folder_.file("run.mcap"); }
  /// Of the first stop.
  [[nodiscard]] const Timeline& timeline() const { return report.timelines.at(0); }

  Report report;

 private:
  test::TemporaryFolder folder_;
};

TEST(Explain, NamesTheNodeThatFellSilentAndSinceAlsoWhereTheRecordingIsCutOff) {
  const Explained run("kind = \"node_silent\"\nnode = \"arm_head_pressure\"\nduration_s = 0.6");
  ASSERT_EQ(run.report.timelines.size(), 1U);
  const Timeline& timeline = run.timeline();
  EXPECT_EQ(timeline.cause.id, "node_silent");
  EXPECT_TRUE(says(timeline.cause.text, "arm_head_pressure (node 0x22)"));
  EXPECT_TRUE(says(timeline.headline, "while engaged"));
  const Duration before = timeline.stop.at - timeline.cause.since;
  EXPECT_GE(before, 25ms);
  EXPECT_LE(before, 40ms);
  EXPECT_TRUE(says(joined(timeline.inputs), "13 of 14 nodes sent in time"));
  const auto whole = std::filesystem::file_size(run.file());
  std::filesystem::resize_file(run.file(), whole - whole / 10);
  const Report cut = Explained::of(run.file());
  ASSERT_EQ(cut.timelines.size(), 1U);
  EXPECT_EQ(cut.timelines[0].cause.id, "node_silent");
  EXPECT_LT(cut.survey.last, run.report.survey.last);
  // Before the stop nothing has stopped.
  std::filesystem::resize_file(run.file(), whole / 4);
  EXPECT_TRUE(Explained::of(run.file()).timelines.empty());
}

/// A fault of scenarios, and what explain calls it.
struct Told {
  const char *fault, *id, *text = "";
  double after_s = 1.3, length_s = 2;
  const char* support = "";
};

TEST(Explain, TellsTroublesApartThatStopTheMachineAlike) {
  for (const Told& told :
       {Told{"kind = \"sync_dropped\"\nduration_s = 0.6", "sync_missing"},  // all nodes fall silent: none is to blame
        Told{"kind = \"valve_stuck\"\njoint = \"arm\"\nduration_s = 1.3", "valve_stuck", "valve of the arm", 1.3, 3},
        Told{"kind = \"node_reset\"\nnode = \"boom_valve\"\nduration_s = 0.6", "node_rebooted"},
        Told{"kind = \"node_emergency\"\nnode = \"boom_valve\"\nduration_s = 0.5", "node_emergency"},
        Told{"kind = \"emcy_storm\"\nnode = \"arm_encoder\"\nduration_s = 0.5", "emergency_storm"},
        Told{"kind = \"encoder_broken\"\njoint = \"arm\"\nduration_s = 0.6", "encoder_wire"},
        Told{"kind = \"sensor_invalid\"\nnode = \"boom_head_pressure\"\nduration_s = 0.6", "sensor_broken"},
        Told{"kind = \"sensor_frozen\"\nnode = \"boom_encoder\"\nduration_s = 3", "sensor_frozen",
             "encoder of the boom", 2.3, 6},
        Told{"kind = \"bus_cut\"\nduration_s = 0.6", "bus_cut"},
        Told{"kind = \"can_down\"\nduration_s = 0.6", "can_down"},
        Told{"kind = \"bus_off\"\nduration_s = 0.6", "bus_off"},
        Told{"kind = \"no_acknowledge\"\nduration_s = 0.6", "bus_disturbed"},
        Told{"kind = \"device_unplugged\"\nduration_s = 0.6", "device_unplugged"},
        Told{"kind = \"device_silent\"\nduration_s = 0.6", "device_silent"},
        Told{"kind = \"device_bad_crc\"\nduration_s = 0.6", "device_reports_damaged"},
        Told{"kind = \"device_truncated\"\nduration_s = 0.6", "device_reports_cut_short"},
        Told{"kind = \"device_wild\"\nduration_s = 0.6", "device_values_impossible"},
        Told{"kind = \"link_nan\"\nduration_s = 0.6", "link_content_damaged"},
        Told{"kind = \"loop_hung\"\nduration_s = 0.6", "machine_loop_paused"},
        Told{"kind = \"other_controller\"\nduration_s = 0.6", "other_controller", "another controller", 1.3, 2,
             "SYNC 0x080 arrived"},
        Told{"kind = \"foreign_sender\"\nnode = \"arm_valve\"\nduration_s = 0.6", "foreign_sender",
             "arm_valve (node 0x11) is commanded by somebody else", 1.3, 2, "set-point 0x211 arrived"},
        Told{"kind = \"node_id_twice\"\nnode = \"arm_head_pressure\"\nduration_s = 0.6", "node_id_twice",
             "node id of arm_head_pressure (node 0x22)", 1.3, 2, "0x1A2 arrived"}}) {
    const Explained run(told.fault, told.after_s, told.length_s);
    ASSERT_FALSE(run.report.timelines.empty()) << told.id;
    const Timeline& timeline = run.timeline();
    EXPECT_EQ(timeline.cause.id, told.id) << timeline.cause.text;
    EXPECT_TRUE(says(timeline.cause.text, told.text));
    const std::string support = told.support;
    EXPECT_TRUE(says(joined(timeline.cause.supports), support));
    EXPECT_TRUE(support.empty() || timeline.stop.at - timeline.cause.since <= 10ms) << told.id << ": seen at once";
    EXPECT_LE(5 + timeline.cause.supports.size() + timeline.cause.against.size() + timeline.inputs.size() +
                  timeline.before.size() + timeline.after.size(),
              40U)
        << told.id << ": fits on a screen";
  }
}

TEST(Explain, OfANodeIdThatTwoUseCountsTheFramesThatTheMachineFileGivesIt) {
  MachineDescription machine = load_machine(find_config("machine", "solar015"));
  constexpr std::uint8_t kTwice = 0x22, kOther = 0x21;
  for (NodeDescription& node : machine.bus.nodes)
    if (node.id == kTwice || node.id == kOther) node.tpdos[0] = node.id == kTwice ? 0x2C3 : 0x3A2;  // not by its own id
  const Stop stop{.at = Time(10s), .reason = {ReasonCode::kNodeIdTwice, kTwice, 26, 13}};
  Window window;
  for (const std::uint32_t id : {0x2C3U, 0x2C3U, 0x3A2U, 0x722U})
    window.can.push_back({stop.at, WireEventKind::kCanReceived, {.id = id}});
  const auto cause = bus_cause(stop, window, machine);
  ASSERT_TRUE(cause);
  EXPECT_EQ(cause->supports, (std::vector<std::string>{"0x2C3 arrived 2 times while SYNC was sent 0 times",
                                                       "0x722 arrived 1 times while SYNC was sent 0 times"}));
}

TEST(Explain, OfALostLinkTheMachinesSideAloneClaimsNoMoreThanItCanKnow) {
  const Explained run("kind = \"link_cut\"\nduration_s = 0.6");
  EXPECT_EQ(run.timeline().cause.id, "link_cut");
  const Cause cause = Explained::of(run.file(), {.operator_side = false}).timelines.at(0).cause;
  EXPECT_EQ(cause.id, "link_cut");
  EXPECT_TRUE(says(cause.text, "or the operator's program"));
  EXPECT_FALSE(cause.against.empty());
}

TEST(Explain, AMachineThatIsNotHeardAnyMoreIsAStopAndHasAFlightRecord) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("run.mcap");
  record_session(faulted_scenario("kind = \"loop_hung\"\nduration_s = 3600", 1.3, 5), file, folder.file("flights"));
  const std::filesystem::directory_iterator flights(folder.file("flights"));
  ASSERT_NE(flights, std::filesystem::directory_iterator());
  for (const std::string& read : {file, flights->path().string()}) {
    const Report report = Explained::of(read);
    ASSERT_FALSE(report.timelines.empty()) << read;
    EXPECT_TRUE(report.timelines[0].stop.machine_unheard) << read;
  }
  const Report whole = Explained::of(file);
  EXPECT_EQ(whole.timelines.size(), 1U);
  EXPECT_EQ(whole.timelines[0].cause.id, "machine_program_gone") << whole.timelines[0].cause.text;
}

TEST(Explain, NamesTheEStopAndWhenTheMachineWasNeutralAndMovedAgain) {
  const Explained run("kind = \"e_stop\"\nduration_s = 0.6");
  const Timeline& timeline = run.timeline();
  EXPECT_EQ(timeline.cause.id, "e_stop");
  ASSERT_TRUE(timeline.followed.commands_neutral && timeline.followed.spools_neutral && timeline.followed.resumed);
  EXPECT_LE(*timeline.followed.commands_neutral - timeline.stop.at, 10ms);
  EXPECT_LE(*timeline.followed.spools_neutral - timeline.stop.at, 150ms);
  ASSERT_TRUE(timeline.followed.released && timeline.followed.pressed);
  EXPECT_LT(*timeline.followed.released, *timeline.followed.pressed);
  EXPECT_LT(*timeline.followed.pressed, *timeline.followed.resumed);
  EXPECT_FALSE(timeline.followed.moved_unasked);
}

TEST(Explain, SaysThatTheOperatorWentOnWithoutTheCylinderAndNotThatItsFaultHadPassed) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("run.mcap");
  record_session(test::content(test::source_dir() + "/config/scenarios/home_on_two.toml"), file);
  const Report report = Explained::of(file);
  ASSERT_EQ(report.timelines.size(), 1U);
  const WhatFollowed& followed = report.timelines[0].followed;
  ASSERT_TRUE(followed.home && followed.resumed);
  EXPECT_LT(*followed.home, *followed.resumed);
  EXPECT_FALSE(followed.cause_gone);
  const std::string after = joined(report.timelines[0].after), inputs = joined(report.timelines[0].inputs);
  EXPECT_TRUE(says(after, "to go home without that cylinder's pressures"));
  EXPECT_TRUE(says(inputs, "where this view ends"));
}

TEST(Explain, SaysOfARecordingWithoutStopsThatThereIsNone) {
  const Explained run("");
  EXPECT_TRUE(run.report.timelines.empty());
  EXPECT_TRUE(run.report.notes.empty()) << joined(run.report.notes);
}

TEST(Explain, NotesAFloodedBusThatStoppedNothing) {
  const Explained run("kind = \"babble\"\nduration_s = 1");
  EXPECT_TRUE(run.report.timelines.empty());
  EXPECT_TRUE(says(joined(run.report.notes), "floods the bus"));
}

TEST(Explain, DoesNotTakeStepsThatTheRecordingLostForAPauseOfTheLoop) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  Stop stop;
  stop.at = Time(1s);
  Window window;
  window.to = Time(1100ms);
  window.machine_steps = {{Time(500ms), 100}, {Time(1s), 101}, {Time(1005ms), 102}};
  EXPECT_TRUE(evidence_of(stop, window, machine).machine_pause.has_value());
  window.machine_steps[1].number = 200;
  window.machine_steps[2].number = 201;
  EXPECT_FALSE(evidence_of(stop, window, machine).machine_pause.has_value());
}

/// A machine's side whose steps are made by hand, without wires.
class HandMade {
 public:
  HandMade() {
    const std::string machine = find_config("machine", "solar015");
    recording::Head head;
    head.has_machine = true;
    head.machine_file = test::content(machine);
    recording::RecorderOptions how;
    how.file = file();
    how.folder = folder_.file("flights");
    recorder_.emplace(how, head, load_machine(machine));
    tap_.record_to(recorder_->machine_steps());
    state.mode = Mode::kEngaged;
    state.enable = state.presence = state.heard = state.device_ok = state.measured = true;
  }
  void step(int times = 1) {
    for (int i = 0; i < times; ++i) {
      state.at += 5ms;
      tap_.end_step(state.at, state, state.fault.code);
      recorder_->drain();
    }
  }
  void stop(const Reason& reason) {
    state.mode = Mode::kFault;
    state.fault = reason;
  }
  [[nodiscard]] Report report() {
    recorder_->close();
    return Explained::of(file());
  }
  [[nodiscard]] std::string file() const { return folder_.file("made.mcap"); }
  /// The only flight record, after report().
  [[nodiscard]] Report flight() const {
    const std::filesystem::directory_iterator flights(folder_.file("flights"));
    return Explained::of(flights->path().string());
  }

  slave::SlaveState state;

 private:
  test::TemporaryFolder folder_;
  std::optional<recording::Recorder> recorder_;
  recording::LoopTap tap_;
};

TEST(Explain, NamesTheOperatorsStop) {
  HandMade run;
  run.step(200);
  run.state.stop = true;
  run.stop({ReasonCode::kOperatorStop, 0, 0, 0});
  run.step(50);
  const Report report = run.report();
  ASSERT_EQ(report.timelines.size(), 1U);
  EXPECT_EQ(report.timelines[0].cause.id, "operator_stop");
  EXPECT_TRUE(says(joined(report.timelines[0].before), "stop on since 1.005 s"));
}

TEST(Explain, OfANodeMissedBeforeItSaysWhyCountsOneStopWithTheBetterReason) {
  HandMade run;
  run.step(10);
  run.stop({ReasonCode::kSensorStale, 0x22, 30, 25});
  run.step(10);
  run.stop({ReasonCode::kNodeFault, 0x22, 127, 5});
  run.step(10);
  const Report report = run.report();
  ASSERT_EQ(report.timelines.size(), 1U);
  EXPECT_EQ(report.timelines[0].stop.reason.code, ReasonCode::kNodeFault);
  EXPECT_EQ(report.timelines[0].stop.before, Mode::kEngaged);
  EXPECT_EQ(report.timelines[0].stop.at, Time(55ms)) << "when it stopped";
}

TEST(Explain, NamesANodeThatSaysItIsPreOperational) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  Stop stop;
  stop.at = Time(1s);
  stop.reason = {ReasonCode::kSensorStale, 0x22, 30, 25};
  Window window;
  window.to = Time(1400ms);
  for (Time at = Time(500ms); at < window.to; at += 5ms) {
    for (const NodeDescription& node : machine.bus.nodes) {
      const bool left = node.id == 0x22 && at > Time(970ms);
      if (!left) window.can.push_back({at, WireEventKind::kCanReceived, {node.tpdo_id(), 5, {}}});
      if (at.time_since_epoch() % 100ms != Duration::zero()) continue;
      const auto state = left ? canopen::NmtState::kPreOperational : canopen::NmtState::kOperational;
      window.can.push_back({at, WireEventKind::kCanReceived, canopen::heartbeat_frame(node.id, state)});
    }
  }
  const Cause cause = likely_cause(stop, window, evidence_of(stop, window, machine), machine);
  EXPECT_EQ(cause.id, "node_not_operational") << cause.text;
  EXPECT_TRUE(says(cause.text, "arm_head_pressure (node 0x22) said at 1.000 s to be pre-operational"));
}

/// A machine whose six pressures are one node's, in three TPDOs. All send in time and change, but for what a test says;
/// the arm moves.
class FewNodes {
 public:
  /// @param chamber whose signal the stop names; none: the node.
  [[nodiscard]] Cause cause(ReasonCode code, std::optional<int> chamber = {}) {
    Stop stop;
    stop.at = Time(1s);
    stop.reason = {code, machine_.bus.pressure(0).id, 4, 6};
    if (chamber) stop.reason.subject = subject_of(NodeRole::kPressure, *chamber, machine_.bus);
    Window window;
    window.to = Time(1400ms);
    int cycle = 0;
    for (Time at = Time(500ms); at < window.to; at += 10ms) {
      slave::SlaveState& state = window.machine.emplace_back();
      state.at = at;
      state.cylinder_m[kArm] = 2 + 1e-3 * ++cycle;
      for (const BusFrame& frame : frames_)
        if (!frame.to_node && (frame.id != missing_ || at <= Time(960ms)))
          window.can.push_back({at, WireEventKind::kCanReceived, sent(frame, at, cycle)});
      if (at.time_since_epoch() % 100ms != Duration::zero()) continue;
      for (const NodeDescription& node : machine_.bus.nodes)
        window.can.push_back(
            {at, WireEventKind::kCanReceived, canopen::heartbeat_frame(node.id, canopen::NmtState::kOperational)});
    }
    return likely_cause(stop, window, evidence_of(stop, window, machine_), machine_);
  }
  /// From then on this channel stays at a value.
  void stands(const std::string& signal, double bar, Time since = Time(500ms)) { standing_[signal] = {since, bar}; }
  void missing(std::uint32_t id) { missing_ = id; }

 private:
  [[nodiscard]] CanFrame sent(const BusFrame& frame, Time at, int cycle) const {
    CanFrame can{.id = frame.id};
    for (const FrameField& field : frame.fields) {
      const bool value = field.part == FrameField::Part::kValue;
      write_raw(field.bits, value ? 1000U + static_cast<unsigned>(cycle % 7) : 0U, can);
      const auto standing = standing_.find(field.channel.info().name);
      if (value && standing != standing_.end() && at >= standing->second.first)
        write_value(field.bits, standing->second.second * kBar, can);
    }
    return can;
  }

  MachineDescription machine_ = parse_machine(test::few_nodes_text(), "few_nodes.toml");
  std::vector<BusFrame> frames_ = bus_frames(machine_.bus, machine_.sensors);
  std::map<std::string, std::pair<Time, double>> standing_;
  std::uint32_t missing_ = 0;
};

TEST(Explain, OfANodeWithSeveralChannelsNamesTheOneThatFroze) {
  FewNodes few;
  few.stands("arm_head_pressure", 80, Time(800ms));
  few.stands("boom_rod_pressure", 40);  // its cylinder stands as well
  few.stands("arm_rod_pressure", 0);    // an empty chamber
  const Cause cause = few.cause(ReasonCode::kSensorImplausible);
  EXPECT_EQ(cause.id, "sensor_frozen") << cause.text;
  EXPECT_EQ(cause.text,
            "the pressure transmitter pressures (node 0x20), arm_head_pressure, froze: it repeated the same value 21 "
            "times, for 200 ms, since 0.800 s");
  EXPECT_TRUE(says(joined(cause.supports), "the cylinder moved by 20 mm"));
}

TEST(Explain, OfANodeWithSeveralChannelsNamesTheOneThatTheLoopRefuses) {
  FewNodes few;
  const Cause none = few.cause(ReasonCode::kSensorInvalid);
  EXPECT_EQ(none.id, "sensor_broken");
  EXPECT_FALSE(says(none.text, "_pressure"));
  struct Case {
    const char* signal;
    double bar;
    const char* told;
  };
  for (const auto& [signal, bar, told] :
       {Case{"boom_rod_pressure", -100, "value -100.0 bar"}, Case{"arm_rod_pressure", 421, "value 421.0 bar"}}) {
    few.stands(signal, 410);  // beyond its range, but believed
    EXPECT_EQ(few.cause(ReasonCode::kSensorInvalid).text, none.text);
    few.stands(signal, bar, Time(900ms));
    const Cause cause = few.cause(ReasonCode::kSensorInvalid);
    EXPECT_EQ(cause.text, "pressures (node 0x20), " + std::string(signal) +
                              ", sends a pressure that cannot be: check sensor and wiring");
    EXPECT_TRUE(says(joined(cause.supports), told));
    EXPECT_EQ(cause.since, Time(900ms));
    few.stands(signal, 410);
  }
}

TEST(Explain, OfANodeWithSeveralChannelsBelievesTheSignalThatTheStopNames) {
  FewNodes few;
  few.stands("arm_head_pressure", 80, Time(800ms));
  few.stands("arm_rod_pressure", 90, Time(700ms));
  const auto told = [&few](ReasonCode code, int chamber) { return few.cause(code, chamber).text; };
  EXPECT_TRUE(says(told(ReasonCode::kSensorImplausible, 2), "(node 0x20), arm_head_pressure, froze"));
  EXPECT_TRUE(says(told(ReasonCode::kSensorImplausible, 3), "(node 0x20), arm_rod_pressure, froze"));
  few.stands("arm_head_pressure", -100);
  few.stands("arm_rod_pressure", -100);
  EXPECT_TRUE(says(told(ReasonCode::kSensorInvalid, 2), "(node 0x20), arm_head_pressure, sends a pressure"));
  EXPECT_TRUE(says(told(ReasonCode::kSensorInvalid, 3), "(node 0x20), arm_rod_pressure, sends a pressure"));
  EXPECT_TRUE(says(told(ReasonCode::kFrameShort, 3), "pressures (node 0x20) sent process data of 4 bytes"));
  few.missing(0x3A0);
  for (const std::optional<int>& chamber : {std::optional<int>(3), std::optional<int>()}) {
    const Cause missing = few.cause(ReasonCode::kSensorStale, chamber);
    EXPECT_EQ(missing.id, "process_data_missing");
    EXPECT_TRUE(says(missing.text, "pressures (node 0x20) sent no TPDO3 since 0.960 s"));
  }
}

TEST(Explain, CountsAFaultThatFollowsAnotherAndNotOneThatStays) {
  HandMade run;
  run.step(10);
  run.stop({ReasonCode::kPresenceLost, 0, 0, 0});
  run.step(10);
  run.stop({ReasonCode::kPresenceLost, 0, 1, 0});
  run.step(10);
  run.stop({ReasonCode::kOperatorStop, 0, 0, 0});
  run.step(10);
  const Report report = run.report();
  ASSERT_EQ(report.timelines.size(), 2U);
  EXPECT_EQ(report.timelines[1].stop.before, Mode::kFault);
}

TEST(Explain, FindsWhatFollowedALaterStopOfTheSameFlightRecord) {
  HandMade run;
  run.step(200);
  run.stop({ReasonCode::kPresenceLost, 0, 0, 0});
  run.step(600);
  run.stop({ReasonCode::kOperatorStop, 0, 0, 0});
  run.step(2000);
  (void)run.report();
  const Report report = run.flight();
  ASSERT_EQ(report.timelines.size(), 2U);
  EXPECT_GE(report.survey.last - report.timelines[1].stop.at, 5s);
  EXPECT_LT(report.survey.last - report.timelines[1].stop.at, 7s);
}

TEST(Explain, DoesNotTakeAStopFromBeforeTheRecordingForOneInIt) {
  HandMade run;
  run.stop({ReasonCode::kPresenceLost, 0, 0, 0});
  run.step(20);
  const Report report = run.report();
  EXPECT_TRUE(report.timelines.empty());
  EXPECT_TRUE(report.survey.begins_stopped);
}

TEST(Explain, RefusesARecordingWithoutStepsInOneLine) {
  HandMade run;
  const std::string said = test::refusal([&] { (void)run.report(); });
  EXPECT_TRUE(says(said, "made.mcap: holds no step of any loop"));
}

}  // namespace
}  // namespace knuckle::explain
