#include "estimation/identification/usual_errors.h"

#include <array>
#include <numbers>

#include "estimation/compliance.h"
#include "estimation/identification/kinematic_calibration.h"
#include "estimation/tare.h"

namespace knuckle::estimation {
namespace {

using Of = UsualError::Of;

// Data sheets of industrial transmitters promise 0.5 % of gain or offset, of slope sensors half a degree: even spreads.
constexpr double kGainPart = 0.005 / std::numbers::sqrt3, kSlope_rad = std::numbers::pi / 360 / std::numbers::sqrt3;
/// Of a cylinder's length behind a survey: what is left of pins and encoder along the rod.
constexpr double kSurveyedLength_m = 0.35e-3;

template <typename Change>
void each_sample(FullInput& input, const Change& change) {
  for (Recording& recording : input.recordings)
    for (Measurement& sample : recording.samples) change(sample);
}

void add_sensors(std::vector<UsualError>& errors, const JointVector& compliance_radpNm) {
  for (std::size_t side = 0; side < std::tuple_size_v<decltype(Measurement::pressure_Pa)>; ++side) {
    errors.push_back({Of::kInput, [side](FullInput& input) {
                        each_sample(input, [side](Measurement& m) { m.pressure_Pa[side] *= 1 + kGainPart; });
                      }});
  }
  errors.push_back({Of::kInput, [](FullInput& input) { input.options.motion.pressure_lag_s += kUsualLag_s; }});
  errors.push_back({Of::kInput, [](FullInput& input) {
                      each_sample(input, [](Measurement& m) { m.hull_pitch_rad += kSlope_rad; });
                    }});
  for (int i = 0; i < kJoints; ++i) {
    errors.push_back({Of::kInput, [i, c = compliance_radpNm[i]](FullInput& input) {
                        input.options.motion.compliance_radpNm[i] += c;
                      }});
  }
}

/// @param member of the machine that it moves.
template <typename Member>
void add_length(std::vector<UsualError>& errors, double sigma_m, Member member) {
  errors.push_back({Of::kInput, [=](FullInput& input) { member(input.machine) += sigma_m; }});
}

void add_pin(std::vector<UsualError>& errors, double sigma_m, PlanarVector& (*pin)(MachineDescription&)) {
  for (const int axis : {0, 1})
    add_length(errors, sigma_m, [=](MachineDescription& m) -> double& { return pin(m)[axis]; });
}

void add_lengths(std::vector<UsualError>& errors, bool surveyed) {
  const GeometryOptions drawing;
  for (int i = 0; i < kJoints; ++i) {
    add_length(errors, surveyed ? kSurveyedLength_m : drawing.encoder_offset_sigma_m,
               [i](MachineDescription& m) -> double& { return m.sensors.encoder_offset_m[i]; });
  }
  if (surveyed) return;
  add_pin(
      errors, drawing.pin_sigma_m, [](MachineDescription & m) -> auto& { return m.boom_mount.parent_pin_m; });
  add_pin(
      errors, drawing.pin_sigma_m, [](MachineDescription & m) -> auto& { return m.boom_mount.child_pin_m; });
  add_pin(
      errors, drawing.pin_sigma_m, [](MachineDescription & m) -> auto& { return m.arm_mount.parent_pin_m; });
  add_pin(
      errors, drawing.pin_sigma_m, [](MachineDescription & m) -> auto& { return m.arm_mount.child_pin_m; });
  add_pin(
      errors, drawing.pin_sigma_m, [](MachineDescription & m) -> auto& { return m.bucket_linkage.cylinder_pin_m; });
  add_pin(
      errors, drawing.pin_sigma_m, [](MachineDescription & m) -> auto& { return m.bucket_linkage.rocker_pin_m; });
  add_pin(
      errors, drawing.pin_sigma_m, [](MachineDescription & m) -> auto& { return m.bucket_linkage.bucket_pin_m; });
  add_length(errors, drawing.rod_sigma_m,
             [](MachineDescription& m) -> double& { return m.bucket_linkage.rocker_length_m; });
  add_length(errors, drawing.rod_sigma_m,
             [](MachineDescription& m) -> double& { return m.bucket_linkage.coupler_length_m; });
}

void add_model(std::vector<UsualError>& errors) {
  for (bool FrictionColumns::*term :
       {&FrictionColumns::dahl, &FrictionColumns::stribeck, &FrictionColumns::load, &FrictionColumns::seal}) {
    errors.push_back({Of::kModel, [term](FullInput& input) { input.options.regressor.friction.*term = false; }});
  }
  errors.push_back({Of::kModel, [](FullInput& input) { input.options.weighted = false; }});
  errors.push_back({Of::kModel, [](FullInput& input) { input.options.huber = 0; }});
}

}  // namespace

std::vector<UsualError> usual_errors(const MachineDescription& machine) {
  std::vector<UsualError> errors;
  add_sensors(errors, usual_compliance_radpNm(machine));
  add_lengths(errors, machine.geometry_calibration.has_value());
  add_model(errors);
  return errors;
}

}  // namespace knuckle::estimation
