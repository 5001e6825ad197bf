// Motions designed for identification: what moves the machine so that its parameters can be told apart, within what it
// may do. Every path starts and ends at rest, is smooth, and passes check_path; the same arguments give the same path.
#pragma once

#include <cstdint>
#include <vector>

#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

// A motion of the three joints to be driven: sampled at a fixed period.

struct JointPath {
  double step_s = 0.005;
  std::vector<JointVector> joint_rad;
  [[nodiscard]] double duration_s() const noexcept { return step_s * static_cast<double>(joint_rad.size()); }
};

/// Bidirectional sweeps for gravity and friction: every cylinder goes to and fro over its working range at a steady
/// speed of its own, 2 to 4 cm/s, sampled anew for every stroke, so that the poses of the others differ at every pass.
/// Slower where the joint's rate limit asks for it. Of several candidates the one with the smallest condition number is
/// taken.
/// @throws InputError where the machine's walls or limits leave no room to move.
[[nodiscard]] JointPath slow_sweeps(const MachineDescription& machine, double duration_s = 120);

/// Joint-limited Fourier series (Swevers et al. 1997) for inertias and viscous friction: to 0.12 m/s at the cylinders
/// where the pump's flow and the tip's speed allow it, content below 0.6 Hz (the oil's own modes are at 3-16 Hz).
/// Coefficients minimise the condition number of the regressor, by random restarts and a local search.
/// @throws InputError as above.
[[nodiscard]] JointPath fast_excitation(const MachineDescription& machine, double duration_s = 80,
                                        std::uint64_t seed = 1);

enum class MotionSpeed : std::uint8_t {
  kSlow,     ///< Fastest cylinder of each move at 2-4 cm/s.
  kDigging,  ///< At 8-12 cm/s, where pump and tip speed allow it.
};

/// For validation, of another shape than what was identified on: dig-like moves from point to point (reach out, lower,
/// crawl, curl, lift, dump) with smooth speed profiles and short stops, points varied by the seed.
[[nodiscard]] JointPath held_out_motion(const MachineDescription& machine, std::uint64_t seed, MotionSpeed speed,
                                        double duration_s = 60);

}  // namespace knuckle::estimation
