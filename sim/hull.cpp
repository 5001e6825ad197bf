#include "sim/hull.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"

namespace knuckle::sim {
namespace {

constexpr double kSettle_s = 0.2;  // in which overloaded ground gives way

}  // namespace

std::array<double, 2> pushes_at_rest_N(const HullTruth& hull, double heave_N, double pitch_Nm) noexcept {
  return {0.5 * heave_N - pitch_Nm / hull.track_m, 0.5 * heave_N + pitch_Nm / hull.track_m};
}

Hull::Hull(const HullTruth& truth, double start_pitch_rad)
    : truth_(truth),
      start_pitch_rad_(start_pitch_rad),
      from_centre_(-truth.centre_m),
      pin_start_m_(Turn(start_pitch_rad) * from_centre_) {}

Hull::Ground Hull::ground(const HullState& s) const noexcept {
  Ground ground;
  for (std::size_t end = 0; end < 2; ++end) {
    const double sinking_m = sinking(end, s.heave_m, s.pitch_rad) - settled_m_[end];
    const double sinking_mps = sinking(end, s.heave_mps, s.pitch_radps);
    const double spring_N = rest_N_[end] + truth_.stiffness_N_per_m * sinking_m;
    if (spring_N <= 0) continue;  // off the ground
    const double push_N = std::max(0.0, spring_N + truth_.damping_Ns_per_m * sinking_mps);
    ground.push_N[end] = push_N;
    ground.heave_N += push_N;
    ground.pitch_Nm += (end == 0 ? -0.5 : 0.5) * truth_.track_m * push_N;
    ground.stored_J += 0.5 * spring_N * spring_N / truth_.stiffness_N_per_m;
    ground.lost_W += (push_N - spring_N) * sinking_mps;
  }
  return ground;
}

void Hull::stand(double heave_N, double pitch_Nm, const std::string& source) {
  rest_N_ = pushes_at_rest_N(truth_, heave_N, pitch_Nm);
  for (const double push_N : rest_N_) {
    if (push_N <= 0)
      throw InputError(fmt::format("{}: hull: tips over at the start: its tracks' ends would carry {:.0f} and {:.0f} N",
                                   source, rest_N_[0], rest_N_[1]));
  }
  borne_N_ = {truth_.bearing_ratio * rest_N_[0], truth_.bearing_ratio * rest_N_[1]};
}

double Hull::settle(const HullState& s, double dt) noexcept {
  double lost_J = 0;
  if (truth_.settling_m_per_N <= 0) return lost_J;
  for (std::size_t end = 0; end < 2; ++end) {
    const double sinking_m = sinking(end, s.heave_m, s.pitch_rad) - settled_m_[end];
    const double spring_N = rest_N_[end] + truth_.stiffness_N_per_m * sinking_m;
    const double over_N = spring_N - borne_N_[end];
    if (over_N <= 0) continue;
    const double way_m = over_N * truth_.settling_m_per_N * std::min(1.0, dt / kSettle_s);
    settled_m_[end] += way_m;
    borne_N_[end] += way_m / truth_.settling_m_per_N;  // what it sank by makes it bear more
    lost_J += (spring_N - 0.5 * truth_.stiffness_N_per_m * way_m) * way_m;
  }
  return lost_J;
}

}  // namespace knuckle::sim
