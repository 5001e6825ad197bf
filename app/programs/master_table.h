// What the operator's side knew and did, as a table.
#pragma once

#include <ostream>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "master/master_loop.h"
#include "transport/link_messages.h"

namespace knuckle::programs {

/// Plain data: crosses from the loop's thread to the one that writes.
struct MasterRow {
  Time at{};
  master::DeviceReading device;
  JointVector setpoint_rad = JointVector::Zero(), setpoint_radps = JointVector::Zero();
  PlanarVector sent_force_N = PlanarVector::Zero();  ///< To the hand's tip, motor limits and joint walls included.
  double round_trip_ms = 0, silence_ms = 0;
  // As last reported by the machine; empty before the first report.
  Mode mode = Mode::kOff;
  ReasonCode blocking = ReasonCode::kNone, fault = ReasonCode::kNone;
  JointVector machine_rad = JointVector::Zero();
  PlanarVector tip_force_N = PlanarVector::Zero();
  double confidence = 0;
};
[[nodiscard]] MasterRow row_of(Time now, const master::MasterLoop& master) noexcept;

void write_master_header(std::ostream& out);
void write_master_row(std::ostream& out, const MasterRow& row);

}  // namespace knuckle::programs
