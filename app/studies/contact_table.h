// Pose by pose and wall by wall: the contact loop as measured on the simulated machine and as the linear model has it.
#pragma once

#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/studies/contact_border.h"

namespace knuckle::studies {

inline constexpr const char* kContactLoopSchema = "knuckle-contact-loop/1";

struct ContactCell {
  ContactPose pose;
  double wall_N_per_m = 0;
};

/// Measured and predicted border, as the tip stiffness Ks below which the hold swings.
struct BorderPair {
  double measured_N_per_m = 0, measured_Hz = 0;
  std::optional<ContactCrossing> predicted;
  /// Predicted over measured; 0 where nothing is predicted.
  [[nodiscard]] double ratio() const noexcept {
    return predicted && measured_N_per_m > 0 ? predicted->stiffness_N_per_m / measured_N_per_m : 0;
  }
  [[nodiscard]] bool within_bound() const noexcept { return ratio() >= kLeastRatio && ratio() <= kMostRatio; }
  static constexpr double kLeastRatio = 0.8, kMostRatio = 1.25;
};

struct ContactRow {
  ContactCell cell;
  BorderPair small;                       ///< Ideal valves: small signals.
  BorderPair large;                       ///< Valves as on file, after the press to which the set-point goes at once.
  HoldSwing at_file;                      ///< Valves and Ks as on file.
  double touch_N = 0;                     ///< v sqrt(k m) of that touch: wall and effective mass alone.
  std::optional<ContactMargins> margins;  ///< At the Ks of the file, small signals.
  std::optional<double> lasting_swing_N;  ///< Likewise, with the dead bands of the file.
};

/// What a hold presses with: 1800 N, less where a wall would let other places of the bucket touch as well.
[[nodiscard]] ContactTrial trial_of(const MachineDescription& machine, const ContactCell& cell, Valves valves,
                                    std::uint64_t seed);
[[nodiscard]] ContactRow contact_row(const MachineDescription& machine, const ContactCell& cell, std::uint64_t seed);

void print_contact_rows(const std::vector<ContactRow>& rows, double stiffness_N_per_m, std::ostream& out);
/// {schema, version, machine, tip_stiffness_N_per_m, bound, passed, rows[]}
void write_contact_rows(const std::vector<ContactRow>& rows, const MachineDescription& machine, std::ostream& out);
/// Every small-signal border within the bound.
[[nodiscard]] bool all_within_bound(const std::vector<ContactRow>& rows);

}  // namespace knuckle::studies
