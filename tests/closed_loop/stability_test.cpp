// Stability in contact over delay x stiffness x grip, whole sessions: the default law holds still in every cell, raw
// force reflection does not where it cannot. The bucket presses on ground in front of the machine: a soft hand has to
// mean to be far inside it, and there is room for that below, while a wall ahead is near the end of the arm's reach.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <string>
#include <tuple>

#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

using sim::LimbClass;

constexpr double kGround_m = -0.5, kDeg = std::numbers::pi / 180;
constexpr double kStill_N = 1.0;          // peak to peak at the hand over the last 3 s
constexpr double kMostLosses = 2;         // of contact, over 50 ms each
constexpr double kWorstLosses = 8;        // known of drawn light grips on hard ground; kMostLosses is the goal there
constexpr double kHoldError_N = 0.3;      // or a tenth of the force
constexpr std::uint64_t kDeepSeeds = 11;  // per cell

struct Cell {
  int round_trip_ms;
  double stiffness_N_per_m;
  LimbClass limb;
};

session::SessionSetup press_on_ground(const Cell& cell, std::uint64_t seed) {
  session::SessionSetup setup = session_setup("wall_contact", seed);
  setup.to_machine.delay = setup.to_operator.delay = cell.round_trip_ms * 1ms / 2;
  setup.limb = sim::sample_limb(cell.limb, seed);
  session::Scenario& scenario = setup.scenario;
  scenario.start_rad = JointVector(40, -75, -40) * kDeg;
  scenario.hand_rad = JointVector(42, -77, -38) * kDeg;
  scenario.world.walls.at(0).stiffness_N_per_m = cell.stiffness_N_per_m;
  scenario.world.walls.at(0).point_m = {2.0, kGround_m};
  scenario.world.walls.at(0).normal = {0, 1};
  sim::Phase& approach = phase_named(scenario, "approach");
  approach.tip_m = {2.1, kGround_m + 0.1};
  phase_named(scenario, "press").direction = {0, -1};
  sim::Phase& release = phase_named(scenario, "release");
  release.tip_m = {2.1, kGround_m + 0.4};
  approach.bucket_rad = release.bucket_rad = -1.3;
  phase_named(scenario, "warm_up").duration_s = 10;  // long enough for the bias filter
  if (cell.limb == LimbClass::kLightGrip) {
    phase_named(scenario, "press").force_N = 1;        // as much as fingertips push for ten seconds
    approach.tolerance_m = release.tolerance_m = 0.3;  // the device's friction moves a hand of 5 N/m that much
  }
  return setup;
}

std::string beyond(const char* what, const session::Metric& value, double bound) {
  if (value && *value <= bound) return "";
  return std::string(what) + " " + (value ? std::to_string(*value) : "not measured") + " > " + std::to_string(bound) +
         "; ";
}

/// Empty where the session was stable by the gate.
std::string instability(const FinishedSession& session, double most_losses = kMostLosses) {
  const session::Metrics& m = session.metrics;
  return beyond("peak to peak N", m.hold_peak_to_peak_N, kStill_N) +
         beyond("contact losses", m.contact_losses, most_losses) + beyond("faults", m.faults, 0) +
         beyond("phases timed out", m.phases_timed_out, 0);
}

/// Empty where what was felt in the hold was the force, too.
std::string untruth(const FinishedSession& session, double held_N) {
  return beyond("hold error N", session.metrics.hold_error_N, std::max(kHoldError_N, 0.1 * held_N));
}

using Parameters = std::tuple<int, double, LimbClass>;

Cell cell_of(const Parameters& p) {
  return {std::get<0>(p), std::get<1>(p), std::get<2>(p)};
}

std::string cell_name(const testing::TestParamInfo<Parameters>& info) {
  const Cell cell = cell_of(info.param);
  return "Rtt" + std::to_string(cell.round_trip_ms) + "ms_Stiffness" +
         std::to_string(std::lround(cell.stiffness_N_per_m / 1e3)) + "kNpm_" + sim::name(cell.limb);
}

const auto kRoundTrips_ms = testing::Values(2, 20, 100);
const auto kStiffnesses_Npm = testing::Values(5e4, 1e6, 2e7);
const auto kLimbs = testing::Values(LimbClass::kRelaxed, LimbClass::kCoContracted, LimbClass::kLightGrip);

class DefaultLaw : public testing::TestWithParam<Parameters> {};

TEST_P(DefaultLaw, HoldsStillInContactWithTheForceThatIsThere) {
  session::SessionSetup setup = press_on_ground(cell_of(GetParam()), 1);
  const FinishedSession session = run_session(setup);
  EXPECT_EQ(instability(session), "");
  EXPECT_EQ(untruth(session, phase_named(setup.scenario, "press").force_N), "");
}

// The outermost cells of the grid; those between them run every night, below.
INSTANTIATE_TEST_SUITE_P(Stability, DefaultLaw,
                         testing::Combine(testing::Values(2, 100), testing::Values(5e4, 2e7), kLimbs), cell_name);

class DefaultLawDrawn : public testing::TestWithParam<Parameters> {};

/// Fingertips of 5 N/m that push with 1 N on hard ground lose contact more often than they should in some drawn
/// sessions (docs/evaluation.md#known-misses): the worst value known is the requirement, until all reach the goal.
bool misses_goal(const Cell& cell) {
  return cell.limb == LimbClass::kLightGrip && cell.stiffness_N_per_m >= 1e6 && cell.round_trip_ms <= 20;
}

TEST_P(DefaultLawDrawn, HoldsStillInContactForDrawnMachinesAndHands) {
  const Cell cell = cell_of(GetParam());
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= kDeepSeeds; ++seed) {
    const FinishedSession session = run_session(press_on_ground(cell, seed));
    EXPECT_EQ(instability(session, misses_goal(cell) ? kWorstLosses : kMostLosses), "") << "seed " << seed;
    worst = std::max(worst, session.metrics.contact_losses.value_or(0));
  }
  EXPECT_EQ(worst > kMostLosses, misses_goal(cell)) << "the goal is reached: make it the requirement";
}

INSTANTIATE_TEST_SUITE_P(DeepStability, DefaultLawDrawn, testing::Combine(kRoundTrips_ms, kStiffnesses_Npm, kLimbs),
                         cell_name);

// Raw reflection renders lambda F, later by the delay T. Ground that feels like a spring K at the hand (the machine's
// own contact spring in series with the ground: 1000 N/m || lambda mu k) becomes the impedance K exp(-sT)/s. Its real
// part -K sin(wT)/w goes down to -K T: not passive, so only the limb can keep the two together, by damping (b > K T) or
// by a loop gain below one at every frequency (stiffer than K). At 100 ms of round trip K T is 91 N s/m over 1e6 N/m
// and 100 over 2e7, without the machine's own lag; relaxed hands and fingertips have 20 N s/m and 500 N/m at most
// against K = 909 and 995 N/m, so they must swing. Nothing is claimed of softer ground (K 333 N/m) or of stiff limbs.
class DirectLaw : public testing::TestWithParam<Parameters> {};

TEST_P(DirectLaw, SwingsWhereTheLimbIsTooSoftForTheDelay) {
  session::SessionSetup setup = press_on_ground(cell_of(GetParam()), 1);
  setup.law = ControlLaw::kDirect;
  const FinishedSession session = run_session(setup);
  const bool swings = session.metrics.hold_peak_to_peak_N.value_or(0) > kStill_N ||
                      session.metrics.contact_losses.value_or(0) > kMostLosses;
  EXPECT_TRUE(swings) << "peak to peak " << session.metrics.hold_peak_to_peak_N.value_or(0) << " N, losses "
                      << session.metrics.contact_losses.value_or(0);
}

INSTANTIATE_TEST_SUITE_P(Stability, DirectLaw,
                         testing::Combine(testing::Values(100), testing::Values(2e7),
                                          testing::Values(LimbClass::kRelaxed, LimbClass::kLightGrip)),
                         cell_name);

}  // namespace
}  // namespace knuckle::test
