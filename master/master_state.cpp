#include "master/master_state.h"

#include <algorithm>

namespace knuckle::master {

MasterState state_of(Time now, const MasterLoop& master) noexcept {
  MasterState state;
  const DeviceReading& device = master.device();
  state.at = now;
  state.device_ok = device.ok;
  state.presence = device.presence;
  state.enable = device.enable;
  state.clutch = device.clutch;
  state.stop = master.stop();
  state.device = device.reason;
  state.report_age_s = age_s(device.measured_at, now);
  const DeviceCounters& counters = master.driver().counters();
  state.reports = counters.reports;
  state.damaged_reports = counters.damaged;
  state.missed_reports = counters.missed;
  state.device_rad = device.joint_rad;
  state.device_radps = device.rate_radps;
  state.setpoint_rad = master.set_point().position_rad();
  state.setpoint_radps = master.set_point().velocity_radps();
  state.law_force_N = master.law_force_N();
  state.sent_force_N = master.sent_force_N();
  state.torque_Nm = master.joint_torque_Nm();
  state.warning = master.warning();
  state.energy_in_J = master.energy().in_J();
  state.energy_out_J = master.energy().out_J();
  state.energy_gain = master.energy().gain();
  if (const auto& told = master.machine()) {
    state.heard = true;
    state.mode = told->mode;
    state.blocking = told->blocking;
    state.fault = told->fault;
    state.machine_rad = told->position_rad;
    state.tip_force_N = told->tip_force_N;
    state.confidence = told->confidence;
    state.home_offered = told->home_offered;
    state.home_on_two = told->home_on_two;
  }
  state.home_asked = master.home_asked();
  state.other_machine = master.other_machine();
  state.round_trip_s = master.round_trip_s();
  state.silence_s = std::min(master.silence_s(), kLongestAge_s);
  state.settings = master.settings();
  return state;
}

}  // namespace knuckle::master
