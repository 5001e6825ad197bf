// What the master loop knew and did in its last step, as plain data: for recordings, tables and replay.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "master/master_loop.h"
#include "transport/link_messages.h"

namespace knuckle::master {

/// SI units; forces on the hand, frame D.
struct MasterState {
  static constexpr const char* kSchemaName = "OperatorState";

  Time at{};  ///< Of the step.
  // The device; stop is pressed there or beside it.
  bool device_ok = false, presence = false, enable = false, clutch = false, stop = false;
  Reason device;
  double report_age_s = 0;
  std::uint64_t reports = 0, damaged_reports = 0, missed_reports = 0;
  JointVector device_rad = JointVector::Zero(), device_radps = JointVector::Zero();
  // What is asked of the machine.
  JointVector setpoint_rad = JointVector::Zero(), setpoint_radps = JointVector::Zero();
  // What the hand feels.
  PlanarVector law_force_N = PlanarVector::Zero();   ///< Requested by the law.
  PlanarVector sent_force_N = PlanarVector::Zero();  ///< Of the motors, joint walls and limits included.
  JointVector torque_Nm = JointVector::Zero();       ///< Likewise, at the joints.
  Reason warning;                                    ///< Why less is felt than the machine feels.
  double energy_in_J = 0, energy_out_J = 0, energy_gain = 1;
  // The machine, as it last reported; zero before.
  bool heard = false;
  Mode mode = Mode::kOff;
  Reason blocking, fault, other_machine;
  JointVector machine_rad = JointVector::Zero();
  PlanarVector tip_force_N = PlanarVector::Zero();  ///< Frame M.
  double confidence = 0;
  // The link.
  double round_trip_s = 0, silence_s = 0;
  MasterSettings settings;

  /// Whether a vector is of the device's joints.
  [[nodiscard]] static bool of_device(std::string_view field) noexcept {
    return field.starts_with("device_") || field == "torque_Nm";
  }
  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    auto& [at, device_ok, presence, enable, clutch, stop, device, report_age_s, reports, damaged_reports,
           missed_reports, device_rad, device_radps, setpoint_rad, setpoint_radps, law_force_N, sent_force_N, torque_Nm,
           warning, energy_in_J, energy_out_J, energy_gain, heard, mode, blocking, fault, other_machine, machine_rad,
           tip_force_N, confidence, round_trip_s, silence_s, settings] = s;
    visit("time_ns", at);
    visit("device_ok", device_ok);
    visit("presence", presence);
    visit("enable", enable);
    visit("clutch", clutch);
    visit("stop", stop);
    visit("device", device);
    visit("report_age_s", report_age_s);
    visit("reports", reports);
    visit("damaged_reports", damaged_reports);
    visit("missed_reports", missed_reports);
    visit("device_rad", device_rad);
    visit("device_radps", device_radps);
    visit("setpoint_rad", setpoint_rad);
    visit("setpoint_radps", setpoint_radps);
    visit("law_force_N", law_force_N);
    visit("sent_force_N", sent_force_N);
    visit("torque_Nm", torque_Nm);
    visit("warning", warning);
    visit("energy_in_J", energy_in_J);
    visit("energy_out_J", energy_out_J);
    visit("energy_gain", energy_gain);
    visit("heard", heard);
    visit("mode", mode);
    visit("blocking", blocking);
    visit("fault", fault);
    visit("other_machine", other_machine);
    visit("machine_rad", machine_rad);
    visit("tip_force_N", tip_force_N);
    visit("confidence", confidence);
    visit("round_trip_s", round_trip_s);
    visit("silence_s", silence_s);
    visit("setting_stop", settings.stop);
    visit("setting_nobody", settings.nobody);
    visit("setting_let_go", settings.let_go);
    visit("setting_assist_force_limit_N", settings.assist.force_limit_N);
    visit("setting_assist_stop_on_object", settings.assist.stop_on_object);
    visit("setting_position_scale", settings.position_scale);
    visit("setting_force_scale", settings.force_scale);
  }
};

/// After a step at `now`. Allocates nothing.
[[nodiscard]] MasterState state_of(Time now, const MasterLoop& master) noexcept;

}  // namespace knuckle::master
