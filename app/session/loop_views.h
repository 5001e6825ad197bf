// What each loop of a session shows the others and the recorder: plain data, so that it can cross threads.
#pragma once

#include <cstddef>
#include <cstdint>

#include "app/session/session_record.h"
#include "core/joints.h"
#include "core/time.h"
#include "machine/kinematics.h"
#include "master/master_state.h"
#include "sim/haptic_device.h"
#include "sim/operator.h"
#include "sim/plant.h"
#include "slave/slave_loop.h"

namespace knuckle::session {

/// Operator, hand and device.
struct HandView {
  sim::HandTruth truth;
  sim::OperatorIntent intent;
  std::uint8_t phase = 0;  ///< Index into SessionRecord::phases.
};

/// Master loop.
struct MasterView {
  master::MasterState state;
  JointVector ghost_rad = JointVector::Zero();  ///< Machine pose that the hand asks for, not clamped.
  double slew_N_per_ms = 0;                     ///< See Sample::felt_slew_N_per_ms.
};

/// @param phases number of phases of the plan; a press that holds counts as one more.
[[nodiscard]] HandView view_of(const sim::HandAndDevice& hand, const sim::Operator& person,
                               const sim::OperatorIntent& intent, std::size_t phases) noexcept;

/// slew_N_per_ms is left to the caller.
[[nodiscard]] MasterView view_of(Time now, const master::MasterLoop& master) noexcept;

/// What the person sees and feels. @param start_rad shown as the machine's pose until the machine has told it.
/// @param breaks pieces seen to give way so far.
[[nodiscard]] sim::OperatorView person_view(const MasterView& master, const JointVector& start_rad,
                                            const sim::HandTruth& hand, int breaks) noexcept;

[[nodiscard]] Truth truth_of(const sim::PlantState& plant) noexcept;
/// One row of the record.
[[nodiscard]] Sample sample_of(Time now, const slave::SlaveLoop& slave, const sim::PlantState& plant,
                               const HandView& hand, const MasterView& master, const Kinematics& kinematics) noexcept;

}  // namespace knuckle::session
