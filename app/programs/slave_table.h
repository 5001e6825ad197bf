// What the machine's side knew and did, as a table: one row each step. The columns of its sensors are those of
// Knuckle's recordings, so that `knuckle identify` reads the same file.
#pragma once

#include <ostream>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "estimation/joint_state.h"
#include "slave/slave_loop.h"
#include "transport/link_messages.h"

namespace knuckle::programs {

/// Plain data: crosses from the loop's thread to the one that writes.
struct SlaveRow {
  Time at{};
  estimation::Measurement measurement;
  JointVector valve = JointVector::Zero(), spool = JointVector::Zero();  ///< After the gate; actual.
  Mode mode = Mode::kOff;
  ReasonCode blocking = ReasonCode::kNone, fault = ReasonCode::kNone;
  JointVector joint_rad = JointVector::Zero(), joint_radps = JointVector::Zero();
  JointVector setpoint_rad = JointVector::Zero();
  PlanarVector tip_force_N = PlanarVector::Zero();  ///< Estimated, frame M.
  double confidence = 0, payload_kg = 0, round_trip_ms = 0;
  bool contact = false;
};
[[nodiscard]] SlaveRow row_of(Time now, const slave::SlaveLoop& slave,
                              const estimation::Measurement& measurement) noexcept;

void write_slave_header(std::ostream& out);
void write_slave_row(std::ostream& out, const SlaveRow& row);

}  // namespace knuckle::programs
