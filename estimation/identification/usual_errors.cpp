#include "estimation/identification/usual_errors.h"

#include <array>
#include <numbers>
#include <utility>

#include "estimation/bias_filter.h"
#include "estimation/compliance.h"
#include "estimation/identification/kinematic_calibration.h"
#include "estimation/length_error.h"

namespace knuckle::estimation {
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

void add_sensors(Errors& errors, const JointVector& compliance_radpNm) {
  for (int side = 0; side < 2 * kJoints; ++side) {
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
  const GeometryOptions drawing;
  for (int i = 0; i < kJoints; ++i) {
    add_length(errors, "length of the " + joint_name(i) + " cylinder",
               surveyed ? kCalibratedLength_m : drawing.encoder_offset_sigma_m,
               [i](Machine& m) -> double& { return m.sensors.encoder_offset_m[i]; });
  }
  if (surveyed) return;
  const double pin_m = drawing.pin_sigma_m, rod_m = drawing.rod_sigma_m;
  add_pin(
      errors, "boom cylinder's pin", pin_m, [](Machine & m) -> auto& { return m.boom_mount.parent_pin_m; });
  add_pin(
      errors, "boom cylinder's rod pin", pin_m, [](Machine & m) -> auto& { return m.boom_mount.child_pin_m; });
  add_pin(
      errors, "arm cylinder's pin", pin_m, [](Machine & m) -> auto& { return m.arm_mount.parent_pin_m; });
  add_pin(
      errors, "arm cylinder's rod pin", pin_m, [](Machine & m) -> auto& { return m.arm_mount.child_pin_m; });
  add_pin(
      errors, "bucket cylinder's pin", pin_m, [](Machine & m) -> auto& { return m.bucket_linkage.cylinder_pin_m; });
  add_pin(
      errors, "rocker's pin", pin_m, [](Machine & m) -> auto& { return m.bucket_linkage.rocker_pin_m; });
  add_pin(
      errors, "coupler's pin", pin_m, [](Machine & m) -> auto& { return m.bucket_linkage.bucket_pin_m; });
  add_length(errors, "rocker", rod_m, [](Machine& m) -> double& { return m.bucket_linkage.rocker_length_m; });
  add_length(errors, "coupler", rod_m, [](Machine& m) -> double& { return m.bucket_linkage.coupler_length_m; });
}

/// No term is left out of a law for nothing, but how far parameters move without it is what is known of how far they
/// may be off because the law is only a law.
void add_model(Errors& errors) {
  const std::array<std::pair<const char*, bool FrictionColumns::*>, 4> terms{
      {{"Dahl state", &FrictionColumns::dahl},
       {"breakaway", &FrictionColumns::stribeck},
       {"load share", &FrictionColumns::load},
       {"friction of seals", &FrictionColumns::seal}}};
  for (const auto& [name, term] : terms) {
    errors.push_back({Of::kModel, name, [term](FullInput& input) {
                        bool& on = input.options.regressor.friction.*term;
                        on = !on;
                      }});
  }
  errors.push_back({Of::kModel, "weights", [](FullInput& input) { input.options.weighted = !input.options.weighted; }});
  errors.push_back({Of::kModel, "outliers", [](FullInput& input) { input.options.huber = 0; }});
}

}  // namespace

std::vector<UsualError> usual_errors(const MachineDescription& machine) {
  Errors errors;
  add_sensors(errors, usual_compliance_radpNm(machine));
  add_lengths(errors, machine.geometry_calibration.has_value());
  add_model(errors);
  return errors;
}

}  // namespace knuckle::estimation
