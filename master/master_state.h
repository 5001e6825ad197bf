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
  bool home_offered = false, home_on_two = false;
  double home_asked = 0;  ///< MasterLoop::home_asked()
  // The link.
  double round_trip_s = 0, silence_s = 0;
  MasterSettings settings;

  /// Whether a vector is of the device's joints.
  [[nodiscard]] static bool of_device(std::string_view field) noexcept {
    return field.starts_with("device_") || field == "torque_Nm";
  }
  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [at, device_ok, presence, enable, clutch, stop, device, report_age_s, reports,
                                  damaged_reports, missed_reports, device_rad, device_radps, setpoint_rad,
                                  setpoint_radps, law_force_N, sent_force_N, torque_Nm, warning, energy_in_J,
                                  energy_out_J, energy_gain, heard, mode, blocking, fault, other_machine, machine_rad,
                                  tip_force_N, confidence, home_offered, home_on_two, home_asked, round_trip_s,
                                  silence_s, settings] = s;
    visit("time_ns", s.at);
    visit("device_ok", s.device_ok);
    visit("presence", s.presence);
    visit("enable", s.enable);
    visit("clutch", s.clutch);
    visit("stop", s.stop);
    visit("device", s.device);
    visit("report_age_s", s.report_age_s);
    visit("reports", s.reports);
    visit("damaged_reports", s.damaged_reports);
    visit("missed_reports", s.missed_reports);
    visit("device_rad", s.device_rad);
    visit("device_radps", s.device_radps);
    visit("setpoint_rad", s.setpoint_rad);
    visit("setpoint_radps", s.setpoint_radps);
    visit("law_force_N", s.law_force_N);
    visit("sent_force_N", s.sent_force_N);
    visit("torque_Nm", s.torque_Nm);
    visit("warning", s.warning);
    visit("energy_in_J", s.energy_in_J);
    visit("energy_out_J", s.energy_out_J);
    visit("energy_gain", s.energy_gain);
    visit("heard", s.heard);
    visit("mode", s.mode);
    visit("blocking", s.blocking);
    visit("fault", s.fault);
    visit("other_machine", s.other_machine);
    visit("machine_rad", s.machine_rad);
    visit("tip_force_N", s.tip_force_N);
    visit("confidence", s.confidence);
    visit("home_offered", s.home_offered);
    visit("home_on_two", s.home_on_two);
    visit("home_asked", s.home_asked);
    visit("round_trip_s", s.round_trip_s);
    visit("silence_s", s.silence_s);
    visit("setting_stop", s.settings.stop);
    visit("setting_nobody", s.settings.nobody);
    visit("setting_let_go", s.settings.let_go);
    visit("setting_home", s.settings.home);
    visit("setting_assist_force_limit_N", s.settings.assist.force_limit_N);
    visit("setting_assist_stop_on_object", s.settings.assist.stop_on_object);
    visit("setting_position_scale", s.settings.position_scale);
    visit("setting_force_scale", s.settings.force_scale);
  }
};

/// After a step at `now`. Allocates nothing.
[[nodiscard]] MasterState state_of(Time now, const MasterLoop& master) noexcept;

}  // namespace knuckle::master
