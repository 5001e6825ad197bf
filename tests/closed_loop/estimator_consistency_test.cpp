// Whether the force estimate's covariance says how wrong it is: over a population of machines that the estimator does
// not know, the normalised error squared e' P^-1 e of a two-dimensional force lies below 5.99 (chi squared, 2 degrees
// of freedom; Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, ch. 5.4) in
// 95 %.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "app/session/record_windows.h"
#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

constexpr std::uint64_t kMachines = 200;
constexpr double kChi95 = 5.99;

/// One look at each machine, as looks at one machine are not independent: two seconds into what it holds.
std::optional<double> normalised_error(const session::SessionRecord& record) {
  const auto windows = session::press_windows(record);
  if (windows.empty()) return std::nullopt;
  const session::Window hold = session::hold_part(record, windows.front());
  if (hold.size() < 2) return std::nullopt;
  const session::Sample& s = record.samples[hold.end - 1];
  const auto& c = s.machine.covariance_N2;
  const Eigen::Matrix2d covariance_N2{{c[0], c[1]}, {c[1], c[2]}};
  const PlanarVector error_N = s.machine.tip_force_N - s.truth.tip_force_N;
  return error_N.dot(covariance_N2.inverse() * error_N);
}

/// Moves freely for as long as the bias filter needs, presses, and holds until the look.
session::SessionSetup press_of(std::uint64_t seed) {
  session::SessionSetup setup = session_setup("wall_contact", seed);
  session::Scenario& scenario = setup.scenario;
  phase_named(scenario, "warm_up").duration_s = 10;
  phase_named(scenario, "press").duration_s = 2;
  while (scenario.phase_names.back() != "press") {
    scenario.phases.pop_back();
    scenario.phase_names.pop_back();
  }
  return setup;
}

session::SessionRecord record_of(const session::SessionSetup& setup) {
  session::Session session(setup);
  while (!session.done()) session.step();
  return session.take_outcome().record;
}

TEST(EstimatorConsistency, NinetyFivePerCentIntervalsCoverWhatTheySay) {
  int looks = 0, covered = 0;
  for (std::uint64_t seed = 1001; seed <= 1000 + kMachines; ++seed) {
    const auto error = normalised_error(record_of(press_of(seed)));
    if (!error) continue;
    ++looks;
    covered += *error < kChi95 ? 1 : 0;
  }
  ASSERT_GT(looks, 180);
  const double share = static_cast<double>(covered) / looks;
  RecordProperty("share", std::to_string(share));
  EXPECT_GE(share, 0.9) << covered << " of " << looks;
  EXPECT_LE(share, 0.99) << covered << " of " << looks;
}

}  // namespace
}  // namespace knuckle::test
