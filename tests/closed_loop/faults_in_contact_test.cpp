// What breaks while the machine presses a wall gives the hand no kick and the wall no push: the session of
// config/scenarios/fault_in_contact.toml with one fault after the other. docs/faults.md has the figures of ten seeds.
#include <gtest/gtest.h>

#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

using sim::FaultKind;

constexpr double kStep_N_per_ms = 0.2;    // of the fault: measured 0.14; the slew limit alone lets 0.4 through
constexpr double kBounce_N_per_ms = 0.3;  // as the hand lets go the machine may bounce back: up to 0.26, seeds 1 to 8
constexpr double kRise_N = 500;           // nothing broken: up to 280 N in five seconds, as hand and valves drift
constexpr double kPressed_N = 1000, kFelt_N = 1.5;

FinishedSession broken_in_contact(FaultKind kind, int subject = 0, std::uint64_t seed = 1) {
  session::SessionSetup setup = session_setup("fault_in_contact", seed);
  setup.to_machine.delay = setup.to_operator.delay = 10ms;
  session::ScheduledFault& fault = setup.scenario.faults.at(0);
  fault.kind = kind;
  fault.subject = subject;
  return run_session(setup);
}

/// Only what is broken in the middle of a press proves anything.
void expect_pressed(const session::SessionRecord& record) {
  ASSERT_EQ(record.injected_s.size(), 1U);
  const auto at = std::find_if(record.samples.begin(), record.samples.end(),
                               [&](const session::Sample& s) { return s.t_s >= record.injected_s[0]; });
  ASSERT_NE(at, record.samples.end());
  EXPECT_EQ((at - 1)->machine.mode, Mode::kEngaged);
  EXPECT_GT((at - 1)->truth.tip_force_N.norm(), kPressed_N);
  EXPECT_GT((at - 1)->hand.felt_N.norm(), kFelt_N);
}

struct Broken {
  const char* name;
  FaultKind kind;
  int subject = 0;  ///< CAN node
  ReasonCode fault = ReasonCode::kNone;
};

class FaultInContact : public testing::TestWithParam<Broken> {};

TEST_P(FaultInContact, NeitherKicksTheHandNorPushesTheWall) {
  const FinishedSession session = broken_in_contact(GetParam().kind, GetParam().subject);
  expect_pressed(session.record);
  EXPECT_LE(session.metrics.fault_slew_N_per_ms, kStep_N_per_ms);
  EXPECT_LE(session.metrics.max_slew_N_per_ms, kBounce_N_per_ms) << "also when it is taken up again, and let go";
  EXPECT_LE(session.metrics.fault_rise_N, kRise_N);
  EXPECT_EQ(session.metrics.resumed_by_itself, 0);
  EXPECT_EQ(session.metrics.phases_timed_out, 0);
  const auto& faults = session.record.faults;
  EXPECT_EQ(faults.empty() ? ReasonCode::kNone : faults.front().reason.code, GetParam().fault);
}

INSTANTIATE_TEST_SUITE_P(
    Faults, FaultInContact,
    testing::Values(Broken{"LinkCut", FaultKind::kLinkCut, 0, ReasonCode::kLinkLost},
                    Broken{"LinkCutBack", FaultKind::kLinkCutBack},
                    Broken{"ClockStep", FaultKind::kClockStep, 0, ReasonCode::kDeviceStale},
                    Broken{"DeviceUnplugged", FaultKind::kDeviceUnplugged, 0, ReasonCode::kDeviceLost},
                    Broken{"EStop", FaultKind::kEStop, 0, ReasonCode::kEmergencyStop},
                    Broken{"PressureFrozen", FaultKind::kSensorFrozen, 0x22},
                    Broken{"EncoderFrozen", FaultKind::kSensorFrozen, 0x31},
                    Broken{"PressureInvalid", FaultKind::kSensorInvalid, 0x20, ReasonCode::kSensorInvalid},
                    Broken{"ValveStuck", FaultKind::kValveStuck, 0x11}),
    [](const auto& test) { return std::string(test.param.name); });

/// A known miss: a bucket encoder that freezes in a hold is not always found, and the wall is pushed by more than
/// kRise_N. It may not get worse by more than a tenth; once no seed misses any more, the encoder belongs to the cases
/// above.
TEST(DeepKnownMissInContact, AFrozenBucketEncoderPushesTheWallNoMoreThanIsKnown) {
  constexpr double kKnown_N = 2000;
  double worst_N = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const FinishedSession session = broken_in_contact(FaultKind::kSensorFrozen, 0x32, seed);
    expect_pressed(session.record);
    ASSERT_TRUE(session.metrics.fault_rise_N) << "seed " << seed;
    worst_N = std::max(worst_N, *session.metrics.fault_rise_N);
    EXPECT_EQ(session.metrics.resumed_by_itself, 0) << "seed " << seed;
  }
  EXPECT_LE(worst_N, 1.1 * kKnown_N);
  EXPECT_GT(worst_N, kRise_N) << "not missed any more";
}

/// The mode that was heard last says nothing of a machine that is not heard any more: these hands, whose press ends
/// just before the link comes back, let go, press anew and lead the machine out of the wall.
void expect_led_out_after_link_cut(std::uint64_t seed) {
  const FinishedSession session = broken_in_contact(FaultKind::kLinkCut, 0, seed);
  EXPECT_EQ(session.metrics.phases_timed_out, 0) << "seed " << seed;
  EXPECT_EQ(session.record.samples.back().truth.tip_force_N.norm(), 0) << "seed " << seed;
}

TEST(RecoveryInContact, HandsDoNotTakeAMachineThatTheyDoNotHearForEngaged) {
  for (const std::uint64_t seed : {4U, 20U}) expect_led_out_after_link_cut(seed);
}

TEST(DeepRecoveryInContact, NorDoOtherHands) {
  expect_led_out_after_link_cut(17);
}

/// The law gives way to cues while the machine presses.
TEST(DowngradeInContact, IsNoStepAndNoPushWhereTheLinkGetsSlowOrLosesMost) {
  for (const auto& [kind, reason] :
       {std::pair{FaultKind::kLinkSlow, ReasonCode::kCuesDelay}, {FaultKind::kLinkLossy, ReasonCode::kCuesLoss}}) {
    const FinishedSession session = broken_in_contact(kind);
    expect_pressed(session.record);
    ASSERT_EQ(session.record.warnings.size(), 1U);
    EXPECT_EQ(session.record.warnings[0].reason.code, reason);
    EXPECT_LE(session.metrics.max_slew_N_per_ms, kStep_N_per_ms);
    EXPECT_LE(session.metrics.fault_rise_N, kRise_N) << "the hand goes on, but is shown nothing";
    EXPECT_TRUE(session.record.faults.empty());
  }
}

}  // namespace
}  // namespace knuckle::test
