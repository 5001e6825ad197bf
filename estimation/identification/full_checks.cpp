// What surrounds the fit of `full`: whether recordings can tell anything, what no residual shows, which arms there can
// be.
#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/symmetric_eigen.h"
#include "core/units.h"
#include "estimation/bias_filter.h"
#include "estimation/identification/full.h"
#include "estimation/identification/kinematic_calibration.h"
#include "estimation/length_error.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr double kLeastUsable_s = 20;       // of data
constexpr double kLeastTravel_rad = 0.1;    // of each joint, end to end
constexpr double kLeastDirected_s = 2;      // in each direction of each cylinder ...
constexpr double kClearlyMoves_mps = 3e-3;  // ... faster than this
constexpr double kLeastConnected_Pa = 1e5;  // a channel that never reaches it is not connected

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) noexcept {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] double width() const noexcept { return high > low ? high - low : 0; }
};

std::string number(double value, int digits) {
  return fmt::format("{:.{}f}", value, digits);
}

std::string channel(std::size_t k) {
  return std::string(kJointNames[k / 2]) + (k % 2 == 0 ? " head" : " rod") + " pressure";
}

void check_pressures(std::span<const Recording> recordings, std::vector<std::string>& faults) {
  std::array<Range, 6> ranges{};
  for (const Recording& recording : recordings) {
    for (std::size_t i = 0; i < recording.samples.size(); ++i) {
      for (std::size_t k = 0; k < 6 && recording.usable[i] != 0; ++k)
        if (recording.samples[i].pressures_known[k / 2]) ranges[k].add(recording.samples[i].pressure_Pa[k]);
    }
  }
  const auto dead = [](const Range& r) { return r.high < kLeastConnected_Pa; };
  if (std::all_of(ranges.begin(), ranges.end(), dead)) {
    faults.push_back("all pressures are below " + number(kLeastConnected_Pa / 1e5, 0) +
                     " bar throughout: no transmitter is connected, or the unit is wrong");
    return;
  }
  for (std::size_t k = 0; k < 6; ++k) {
    const bool measured = std::isfinite(ranges[k].high);
    if (measured && ranges[k].width() == 0)
      faults.push_back(channel(k) + " never changes: " + number(ranges[k].high / 1e5, 1) + " bar");
  }
}

void check_joint(int joint, std::span<const Motion> motions, std::vector<std::string>& faults) {
  const std::string name = kJointNames[static_cast<std::size_t>(joint)];
  Range angle;
  double extending_s = 0, retracting_s = 0;
  for (const Motion& motion : motions) {
    for (const Stretch& stretch : motion.stretches) {
      for (Eigen::Index n = stretch.first; n < stretch.end; ++n) {
        angle.add(motion.joint_rad(joint, n));
        if (motion.cylinder_mps(joint, n) > kClearlyMoves_mps) extending_s += motion.step_s;
        if (motion.cylinder_mps(joint, n) < -kClearlyMoves_mps) retracting_s += motion.step_s;
      }
    }
  }
  if (angle.width() < kLeastTravel_rad) {
    faults.push_back(name + " moves over " + number(angle.width() / kDegree, 1) + " deg only, at least " +
                     number(kLeastTravel_rad / kDegree, 1) + " deg are needed");
    return;
  }
  const auto one_way = [&](double time_s, const char* direction) {
    if (time_s >= kLeastDirected_s) return;
    faults.push_back(name + " cylinder " + direction + " for " + number(time_s, 1) + " s only, at least " +
                     number(kLeastDirected_s, 1) +
                     " s are needed: one direction alone does not separate friction from weight");
  };
  one_way(extending_s, "extends");
  one_way(retracting_s, "retracts");
}

}  // namespace

std::vector<std::string> excitation_faults(std::span<const Recording> recordings, std::span<const Motion> motions) {
  std::vector<std::string> faults;
  double duration_s = 0;
  for (const Motion& motion : motions) duration_s += motion.duration_s();
  if (duration_s < kLeastUsable_s) {
    faults.push_back(number(duration_s, 1) + " s of usable data, at least " + number(kLeastUsable_s, 1) +
                     " s are needed");
  }
  if (duration_s <= 0) return faults;
  check_pressures(recordings, faults);
  for (int joint = 0; joint < kJoints; ++joint) check_joint(joint, motions, faults);
  return faults;
}

namespace {

using Of = UsualError::Of;
using Errors = std::vector<UsualError>;

// What data sheets of industrial transmitters (0.5 % of span) and slope sensors (half a degree) promise, evenly spread.
constexpr double kGainPart = 0.005 / std::numbers::sqrt3, kSlope_rad = std::numbers::pi / 360 / std::numbers::sqrt3;

std::string joint_name(int joint) {
  return kJointNames[static_cast<std::size_t>(joint)];
}

template <typename Change>
void each_sample(FullInput& input, const Change& change) {
  for (Recording& recording : input.recordings)
    for (Measurement& sample : recording.samples) change(sample);
}

/// @param without joint whose cylinder has no transmitters, or none.
void add_sensors(Errors& errors, const JointVector& compliance_radpNm, int without) {
  for (int side = 0; side < 2 * kJoints; ++side) {
    if (side / 2 == without) continue;
    const auto scale = [side](Measurement& m) { m.pressure_Pa[static_cast<std::size_t>(side)] *= 1 + kGainPart; };
    errors.push_back({Of::kInput, "gain of " + joint_name(side / 2) + " pressure " + (side % 2 == 0 ? "A" : "B"),
                      [scale](FullInput& input) { each_sample(input, scale); }});
  }
  errors.push_back({Of::kInput, "lag of the pressures",
                    [](FullInput& input) { input.options.motion.pressure_lag_s += kUsualLag_s; }});
  const auto tilt = [](Measurement& m) { m.hull_pitch_rad += kSlope_rad; };
  errors.push_back({Of::kInput, "slope sensor", [tilt](FullInput& input) { each_sample(input, tilt); }});
  // With the ground: fast motion rocks the hull quicker than the mean that is taken of the slope sensor.
  for (int i = 0; i < kJoints; ++i) {
    if (i == without) continue;
    errors.push_back(
        {Of::kInput, "compliance of the " + joint_name(i),
         [i, c = compliance_radpNm[i]](FullInput& input) { input.options.motion.compliance_radpNm[i] += c; }});
  }
}

/// @param member of the machine, which it moves.
template <typename Member>
void add_length(Errors& errors, const std::string& name, double sigma_m, Member member) {
  errors.push_back({Of::kInput, name, [=](FullInput& input) { member(input.machine) += sigma_m; }});
}

void add_pin(Errors& errors, const std::string& name, double sigma_m, PlanarVector& (*pin)(MachineDescription&)) {
  for (const int axis : {0, 1})
    add_length(errors, name, sigma_m, [=](MachineDescription& m) -> double& { return pin(m)[axis]; });
}

void add_lengths(Errors& errors, bool surveyed) {
  using Machine = MachineDescription;
  for (int i = 0; i < kJoints; ++i) {
    add_length(errors, "length of the " + joint_name(i) + " cylinder",
               surveyed ? kCalibratedLength_m : kEncoderOffsetSigma_m,
               [i](Machine& m) -> double& { return m.sensors.encoder_offset_m[i]; });
  }
  if (surveyed) return;
  add_pin(
      errors, "boom cylinder's pin", kPinSigma_m, [](Machine & m) -> auto& { return m.boom_mount.parent_pin_m; });
  add_pin(
      errors, "boom cylinder's rod pin", kPinSigma_m, [](Machine & m) -> auto& { return m.boom_mount.child_pin_m; });
  add_pin(
      errors, "arm cylinder's pin", kPinSigma_m, [](Machine & m) -> auto& { return m.arm_mount.parent_pin_m; });
  add_pin(
      errors, "arm cylinder's rod pin", kPinSigma_m, [](Machine & m) -> auto& { return m.arm_mount.child_pin_m; });
  add_pin(
      errors, "bucket cylinder's pin", kPinSigma_m,
      [](Machine & m) -> auto& { return m.bucket_linkage.cylinder_pin_m; });
  add_pin(
      errors, "rocker's pin", kPinSigma_m, [](Machine & m) -> auto& { return m.bucket_linkage.rocker_pin_m; });
  add_pin(
      errors, "coupler's pin", kPinSigma_m, [](Machine & m) -> auto& { return m.bucket_linkage.bucket_pin_m; });
  add_length(errors, "rocker", kRodSigma_m, [](Machine& m) -> double& { return m.bucket_linkage.rocker_length_m; });
  add_length(errors, "coupler", kRodSigma_m, [](Machine& m) -> double& { return m.bucket_linkage.coupler_length_m; });
}

/// No term is left out of a law for nothing, but how far parameters move without it is what is known of how far they
/// may be off because the law is only a law.
void add_model(Errors& errors) {
  const auto add = [&](const char* name, bool FrictionColumns::*term) {
    errors.push_back({Of::kModel, name, [term](FullInput& input) {
                        bool& on = input.options.regressor.friction.*term;
                        on = !on;
                      }});
  };
  add("Dahl state", &FrictionColumns::dahl);
  add("breakaway", &FrictionColumns::stribeck);
  add("load share", &FrictionColumns::load);
  add("friction of seals", &FrictionColumns::seal);
  errors.push_back({Of::kModel, "weights", [](FullInput& input) { input.options.weighted = !input.options.weighted; }});
  errors.push_back({Of::kModel, "outliers", [](FullInput& input) { input.options.huber = 0; }});
}

}  // namespace

std::vector<UsualError> usual_errors(const MachineDescription& machine) {
  Errors errors;
  add_sensors(errors, usual_compliance_radpNm(machine), machine.sensors.without_pressures);
  add_lengths(errors, machine.geometry_calibration.has_value());
  add_model(errors);
  return errors;
}

namespace {

/// Unknowns x in place of parameters p, so that every condition is a bound of one: d_i for J_i; for each cylinder's
/// Coulomb forces their mean and half their difference; for breakaway the static friction.
template <typename Vector>
void to_parameters(const JointVector& greatest_kg, Vector& p) {
  for (int i = 0; i < kJoints; ++i) {
    p[i] = (p[3 + i] * p[3 + i] + p[6 + i] * p[6 + i]) / greatest_kg[i] + p[i] * p[i];
    auto &extend = p[friction_index(i, kCoulombExtend)], &retract = p[friction_index(i, kCoulombRetract)];
    const auto mean = extend, offset = retract;
    extend = mean + offset;
    retract = mean - offset;
    p[friction_index(i, kBreakaway)] -= mean;
  }
}

/// |R (p(x) - free)|^2 with R^T R = information.
class DistanceCost {
 public:
  DistanceCost(const CalibrationVector& free, const CalibrationMatrix& information, const JointVector& greatest_kg)
      : free_(free), greatest_kg_(greatest_kg) {
    const SymmetricEigen eigen = symmetric_eigen(information);
    root_ = eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
  }
  template <typename T>
  bool operator()(const T* x, T* residual) const {
    using Vector = Eigen::Matrix<T, kCalibrationCount, 1>;
    Vector p = Eigen::Map<const Vector>(x);
    to_parameters(greatest_kg_, p);
    Eigen::Map<Vector> r(residual);
    r = root_.cast<T>() * (p - free_.cast<T>());
    return true;
  }

 private:
  CalibrationVector free_;
  JointVector greatest_kg_;
  CalibrationMatrix root_;
};

/// The unknowns of a cylinder's friction that have a bound: viscosity, mean Coulomb and static friction, what load and
/// seals add.
std::array<int, 5> bounded_friction(int joint) noexcept {
  return {friction_index(joint, kViscous), friction_index(joint, kCoulombExtend), friction_index(joint, kBreakaway),
          friction_index(joint, kLoadShare), friction_index(joint, kSeal)};
}
constexpr double kLeastFriction = 1e-9;  // SI units; not 0, which the digits of a file round to either side

/// Puts what is below its bound onto it, and says which unknowns stay there.
void hold_at_bounds(CalibrationVector& x, std::vector<int>& held) {
  for (int i = 0; i < kJoints; ++i) {
    for (const int k : bounded_friction(i)) {
      if (x[k] >= kLeastFriction) continue;
      x[k] = kLeastFriction;
      held.push_back(k);
    }
  }
}

double least_inertia(const CalibrationVector& p, int link, const JointVector& greatest_kg) noexcept {
  return (std::pow(p[3 + link], 2) + std::pow(p[6 + link], 2)) / greatest_kg[link];
}

}  // namespace

JointVector greatest_mass_kg(const MachineDescription& machine) {
  constexpr double kMore = 1.25;
  JointVector mass = JointVector::Zero();
  double beyond = machine.bucket_linkage.rocker_mass_kg + machine.bucket_linkage.coupler_mass_kg;
  for (int i = kJoints - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    beyond += machine.links[k].mass_kg + machine.cylinders[k].body_mass_kg + machine.cylinders[k].rod_mass_kg;
    mass[i] = kMore * beyond;
  }
  return mass;
}

bool physically_consistent(const CalibrationVector& parameters, const JointVector& greatest_kg) noexcept {
  for (int i = 0; i < kJoints; ++i) {
    if (!(parameters[i] >= least_inertia(parameters, i, greatest_kg))) return false;
    const auto friction = [&](FrictionIndex which) { return parameters[friction_index(i, which)]; };
    const double coulomb_N = (friction(kCoulombExtend) + friction(kCoulombRetract)) / 2;
    if (!(friction(kViscous) >= 0 && coulomb_N >= 0 && coulomb_N + friction(kBreakaway) >= 0 &&
          friction(kLoadShare) >= 0 && friction(kSeal) >= 0))
      return false;
  }
  return true;
}

CalibrationVector nearest_consistent(const CalibrationVector& free, const CalibrationMatrix& information,
                                     const JointVector& greatest_kg) {
  if (physically_consistent(free, greatest_kg)) return free;
  CalibrationVector x = free;
  for (int i = 0; i < kJoints; ++i) {
    const double least = least_inertia(free, i, greatest_kg);
    // Not at 0, where the slope of d^2 is none.
    x[i] = std::sqrt(std::max(free[i] - least, 0.05 * least + 1e-6));
    auto &extend = x[friction_index(i, kCoulombExtend)], &retract = x[friction_index(i, kCoulombRetract)];
    const double mean = (extend + retract) / 2, offset = (extend - retract) / 2;
    x[friction_index(i, kBreakaway)] += std::max(mean, 0.0);
    extend = mean;
    retract = offset;
  }
  ceres::Problem problem;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DistanceCost, kCalibrationCount, kCalibrationCount>(
                               new DistanceCost(free, information, greatest_kg)),
                           nullptr, x.data());
  ceres::Solver::Options options;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  // Ceres' own bounds cut each step: where unknowns are coupled it then ends away from the minimum.
  std::vector<int> held;
  std::size_t known = 0;
  hold_at_bounds(x, held);
  do {
    known = held.size();
    problem.SetManifold(x.data(), new ceres::SubsetManifold(kCalibrationCount, held));
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    hold_at_bounds(x, held);
  } while (held.size() > known);
  to_parameters(greatest_kg, x);
  for (int k = 0; k < kCalibrationCount; ++k) {
    if (information(k, k) == 0) x[k] = free[k];
  }
  return x;
}

}  // namespace knuckle::estimation
