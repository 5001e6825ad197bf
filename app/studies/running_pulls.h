// Known pulls on a machine whose side runs: what the slave loop itself reports of them, through bus, estimator and
// contact model, while it holds the machine still or lets it creep. trials.h judges the same estimator on recordings.
#pragma once

#include <cstdint>

#include "app/battery/rows.h"
#include "machine/contact_model.h"
#include "machine/description_fwd.h"
#include "sim/truth.h"

namespace knuckle::studies {

struct PullPlan {
  double free_s = 30;              ///< Of free motion, slow and at digging speed each.
  int poses = 5, directions = 12;  ///< Of pulls at the tip; each standing and creeping.
  int push_poses = 5;              ///< Of pushes on the sides of the bucket's outline, likewise.
};

/// Drives the machine with this contact model and judges what the slave loop reports, the load included. With
/// force_and_position the file's direction is one of six, by the seed; it is pulled both ways along it, and not pushed.
/// Metrics: answered (0 or 1: a pull may be refused) and add_presses() of pulls at the tip; press_covered of them.
/// Torque about the tip, of which free motion has none and pulls at the tip neither: free_torque_Nm,
/// tip_torque_error_Nm, and its 95 % interval: free_torque_covered [looks, of], tip_torque_covered. Offset of the line
/// of action there: tip_offset_m, tip_offset_covered. Pushes beside the tip: beside_error_N, beside_covered,
/// beside_torque_error_Nm, beside_torque_good (within 40 N m or 15 %), beside_torque_covered, beside_offset_m,
/// beside_offset_covered; side_right (the side pushed on has more than half of the probability), and side_right.NAME of
/// each, of those at 30 degrees or more to the side. free_covered and false_alarms as score_estimator() has them.
/// @param machine as the controller sees it. @throws NotLed; Interrupted once a signal has come.
[[nodiscard]] battery::Row score_running(MachineDescription machine, const sim::MachineTruth& truth, ContactModel model,
                                         const PullPlan& plan, std::uint64_t seed);

}  // namespace knuckle::studies
