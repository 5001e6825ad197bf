// Every fault ends in neutral on the CAN wire, in time; nothing moves again by itself; and after letting go and
// pressing again it does. Judged from the text of the recorded frames with the identifiers and layouts of the wire
// formats stated again here, not by the code that is judged.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <sstream>

#include "tests/closed_loop/session_rig.h"
#include "tests/support/candump.h"
#include "transport/timed_frame.h"

namespace knuckle::test {
namespace {

using sim::FaultKind;

// The machine's bus, again.
constexpr unsigned kFirstValve = 0x10, kSetPointPdo = 0x200, kActualPdo = 0x180, kSync = 0x080, kHeartbeat = 0x701;
constexpr unsigned kEnableInputs = 0x1C0, kPilotOn = 2;
constexpr unsigned kActive = 7;  // control word 0x6040, lowest three bits
constexpr int kDeadBand = 1802;  // 11 % of a stroke of 16384
constexpr double kDeadBandShare = 0.11;
// What is asked.
constexpr double kCommandNeutral_s = 0.2, kSpoolNeutral_s = 0.32;
// The story.
enum : int { kEngage, kMoving, kWaiting, kAgain, kMovingAgain };
constexpr double kFaultAfter_s = 2.3, kFaultLasts_s = 1.0;
constexpr double kRow_s = 0.005;

sim::Phase sweep(double duration_s) {
  sim::Phase phase;
  phase.kind = sim::PhaseKind::kSweep;
  phase.joints_rad = JointVector(10, 14, 16) * (std::numbers::pi / 180);
  phase.periods_s = JointVector(7, 6, 5);
  phase.duration_s = duration_s;
  return phase;
}

/// Engage, sweep until the machine stops, go on holding enable for a while, engage anew, sweep.
session::SessionSetup story(const session::ScheduledFault& fault, std::uint64_t seed) {
  session::SessionSetup setup = session_setup("link_faults", seed);
  session::Scenario& scenario = setup.scenario;
  sim::Phase engage, wait;
  engage.kind = sim::PhaseKind::kEngage;
  wait.kind = sim::PhaseKind::kWait;
  wait.duration_s = 3.5;
  scenario.phases = {engage, sweep(4), wait, engage, sweep(3)};
  scenario.phases[kMoving].until_fault = true;
  scenario.phase_names = {"engage", "moving", "waiting", "again", "moving_again"};
  scenario.faults = {fault};
  scenario.duration_s = 60;
  return setup;
}

/// A finished story, its wire as text would tell it, and when what happened.
struct Told {
  session::SessionRecord record;
  std::vector<WireFrame> wire;
  double broken_s = 0, released_s = 0;  ///< The fault; the operator letting go of enable.

  explicit Told(FinishedSession session) : record(std::move(session.record)) {
    std::stringstream log;
    for (const TimedFrame& f : session.frames) log << candump_line(f.at, f.frame) << '\n';
    wire = read_candump(log);
    broken_s = start_of(kMoving) - kRow_s + kFaultAfter_s;  // a row may come up to a step late: never too kind
    released_s = start_of(kAgain) - kRow_s;
  }
  double start_of(int phase) const {
    for (const session::Sample& s : record.samples) {
      if (s.phase == phase) return s.t_s;
    }
    ADD_FAILURE() << "phase " << phase << " was never reached";
    return 1e9;
  }
};

bool commands_motion(const WireFrame& f) {
  return f.id >= kSetPointPdo + kFirstValve && f.id < kSetPointPdo + kFirstValve + 3 && (f.u16(0) & 7U) == kActive &&
         f.i16(2) != 0;
}

bool spool_is_open(const WireFrame& f) {
  return f.id >= kActualPdo + kFirstValve && f.id < kActualPdo + kFirstValve + 3 && std::abs(f.i16(2)) > kDeadBand;
}

bool pilot_is_on(const WireFrame& f) {
  return f.id == kEnableInputs && (f.data.at(0) & kPilotOn) != 0;
}

/// When the last of the nodes that broke a rule before `until` was first seen to keep it again; `from` where none did.
/// NaN: one was never seen to.
double kept_since(const std::vector<WireFrame>& wire, bool (*breaks)(const WireFrame&), double from, double until) {
  std::map<unsigned, double> since;  // by identifier; NaN while the rule is broken
  for (const WireFrame& f : wire) {
    if (f.at_s >= until) break;
    if (breaks(f)) {
      since[f.id] = std::nan("");
    } else if (const auto it = since.find(f.id); it != since.end() && std::isnan(it->second)) {
      it->second = f.at_s;
    }
  }
  double all = from;
  for (const auto& [id, at_s] : since) all = std::isnan(at_s) ? at_s : std::max(all, at_s);
  return all;
}

/// Time of the last row in [from, until) in which a spool is truly open; `from` if there is none.
double truly_closed_since(const session::SessionRecord& record, double from, double until) {
  double last = from;
  for (const session::Sample& s : record.samples) {
    if (s.t_s < until && s.truth.spool.cwiseAbs().maxCoeff() > kDeadBandShare) last = std::max(last, s.t_s);
  }
  return last;
}

bool moves_between(const std::vector<WireFrame>& wire, double from, double until) {
  return std::any_of(wire.begin(), wire.end(),
                     [&](const WireFrame& f) { return f.at_s >= from && f.at_s < until && commands_motion(f); });
}

double turned_rad(const session::SessionRecord& record, double from, double until) {
  JointVector low = JointVector::Constant(1e9), high = -low;
  for (const session::Sample& s : record.samples) {
    if (s.t_s < from || s.t_s >= until) continue;
    low = low.cwiseMin(s.truth.joint_rad);
    high = high.cwiseMax(s.truth.joint_rad);
  }
  return (high - low).maxCoeff();
}

/// Who can be asked what the machine did.
enum class Witness {
  kFrames,  ///< what valves are told and where they say that their spools are
  kPilot,   ///< valves do not tell their position: the enable node says that pilot pressure is off
  kNodes,   ///< nor does the controller say anything: valves and enable node stop by themselves
};

struct Fault {
  const char* name;
  FaultKind kind;
  int subject = 0;  ///< CAN node
  Witness witness = Witness::kFrames;
};

class EveryFault : public testing::TestWithParam<Fault> {
 protected:
  static Told told(std::uint64_t seed) {
    const Fault& fault = GetParam();
    return Told(run_session(story({fault.kind, kMoving, kFaultAfter_s, kFaultLasts_s, fault.subject}, seed)));
  }
  /// Of the machine and hands of that seed.
  static void expect_neutral_until_asked_again(std::uint64_t seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Told t = told(seed);
    ASSERT_TRUE(moves_between(t.wire, t.broken_s - 0.1, t.broken_s)) << "nothing moved that a fault could stop";
    ASSERT_EQ(t.record.faults.size(), 1u);

    const Witness witness = GetParam().witness;
    if (witness != Witness::kNodes) {
      EXPECT_LE(kept_since(t.wire, commands_motion, t.broken_s, t.released_s) - t.broken_s, kCommandNeutral_s);
    }
    EXPECT_FALSE(moves_between(t.wire, t.broken_s + kFaultLasts_s, t.released_s)) << "resumed by itself";

    const auto breaks = witness == Witness::kFrames ? spool_is_open : pilot_is_on;
    EXPECT_LE(kept_since(t.wire, breaks, t.broken_s, t.released_s) - t.broken_s, kSpoolNeutral_s);
    EXPECT_LE(truly_closed_since(t.record, t.broken_s, t.released_s) - t.broken_s, kSpoolNeutral_s);
    EXPECT_LT(turned_rad(t.record, t.broken_s + 1, t.released_s), 0.01) << "the machine did not stay where it was";

    // Enable let go and pressed again, it works again.
    const double again_s = t.start_of(kMovingAgain);
    EXPECT_TRUE(moves_between(t.wire, again_s, again_s + 3));
    EXPECT_GT(turned_rad(t.record, again_s, again_s + 3), 0.05);
    EXPECT_EQ(t.record.phases_timed_out, 0);
  }
};

TEST_P(EveryFault, EndsInNeutralAndWaitsForTheOperator) {
  expect_neutral_until_asked_again(1 + static_cast<std::uint64_t>(GetParam().kind) % 3);
}

class EveryFaultDrawn : public EveryFault {};

TEST_P(EveryFaultDrawn, EndsInNeutralAndWaitsForTheOperator) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) expect_neutral_until_asked_again(seed);
}

const Fault kEachFault[] = {Fault{"LinkCut", FaultKind::kLinkCut},
                            Fault{"LinkNaN", FaultKind::kLinkNaN},
                            Fault{"PressureNodeSilent", FaultKind::kNodeSilent, 0x22},
                            Fault{"EncoderNodeSilent", FaultKind::kNodeSilent, 0x30},
                            Fault{"ValveNodeSilent", FaultKind::kNodeSilent, 0x11, Witness::kPilot},
                            Fault{"ValveNodeReset", FaultKind::kNodeReset, 0x10, Witness::kPilot},
                            Fault{"EmergencyStorm", FaultKind::kEmcyStorm, 0x31},
                            Fault{"SyncDropped", FaultKind::kSyncDropped, 0, Witness::kPilot},
                            Fault{"BusCut", FaultKind::kBusCut, 0, Witness::kNodes},
                            Fault{"BusOff", FaultKind::kBusOff, 0, Witness::kNodes},
                            Fault{"CanDown", FaultKind::kCanDown, 0, Witness::kNodes},
                            Fault{"NoAcknowledge", FaultKind::kNoAcknowledge},
                            Fault{"DeviceUnplugged", FaultKind::kDeviceUnplugged},
                            Fault{"DeviceTruncated", FaultKind::kDeviceTruncated},
                            Fault{"LoopHung", FaultKind::kLoopHung, 0, Witness::kNodes},
                            Fault{"EStop", FaultKind::kEStop}};
const auto kFaultName = [](const auto& test) { return std::string(test.param.name); };
INSTANTIATE_TEST_SUITE_P(Faults, EveryFault, testing::ValuesIn(kEachFault), kFaultName);
INSTANTIATE_TEST_SUITE_P(DeepFaults, EveryFaultDrawn, testing::ValuesIn(kEachFault), kFaultName);

TEST(HungLoop, LooksDeadOnTheWire) {
  const Told t(run_session(story({FaultKind::kLoopHung, kMoving, kFaultAfter_s, kFaultLasts_s, 0}, 1)));
  for (const WireFrame& f : t.wire) {
    const bool from_controller = f.id == kSync || f.id == kHeartbeat || f.id / 0x100 == kSetPointPdo / 0x100;
    if (f.at_s < t.broken_s + 2 * kRow_s || f.at_s > t.broken_s + kFaultLasts_s - kRow_s) continue;
    ASSERT_FALSE(from_controller) << std::hex << f.id << std::dec << " at " << f.at_s;
  }
}

// The reader above can tell: the same story without a fault is full of motion until the end.
TEST(FaultJudge, SeesMotionWhereNothingFails) {
  session::SessionSetup setup = story({}, 1);
  setup.scenario.faults.clear();
  setup.scenario.phases[kMoving].until_fault = false;
  setup.scenario.phases[kWaiting] = setup.scenario.phases[kMoving];
  const Told t(run_session(setup));
  EXPECT_TRUE(moves_between(t.wire, t.broken_s + kFaultLasts_s, t.released_s));
  EXPECT_FALSE(kept_since(t.wire, commands_motion, t.broken_s, t.released_s) - t.broken_s <= kCommandNeutral_s);
  EXPECT_GT(truly_closed_since(t.record, t.broken_s, t.released_s) - t.broken_s, kSpoolNeutral_s);
}

}  // namespace
}  // namespace knuckle::test
