// Pose by pose and wall by wall: the contact loop as measured on the simulated machine and as the linear model has it.
#pragma once

#include <optional>
#include <ostream>
#include <vector>

#include "app/studies/contact_border.h"

namespace knuckle::studies {

inline constexpr const char* kContactLoopSchema = "knuckle-contact-loop/2";

struct ContactCell {
  ContactPose pose;
  double wall_N_per_m = 0;
};

/// Of one key of the law, predicted for the calm hold next to the measured one.
struct BorderPair {
  MeasuredBorder measured;
  std::optional<PredictedBorder> predicted;  ///< nullopt: calm wherever the key may be set.
  /// Predicted over measured; 0 where one of them has none.
  [[nodiscard]] double ratio() const noexcept { return has_both() ? predicted->value / measured.value : 0; }
  [[nodiscard]] bool within_bound() const noexcept {
    if (!measured.found && !predicted) return measured.calm.calm;
    return ratio() >= kLeastRatio && ratio() <= kMostRatio;
  }
  [[nodiscard]] bool has_both() const noexcept { return measured.found && predicted; }
  static constexpr double kLeastRatio = 0.8, kMostRatio = 1.25;
};

struct ContactRow {
  ContactCell cell;
  HoldSwing small_at_file;  ///< Ideal valves, all keys as on file. With trouble there nothing else is measured.
  BorderPair stiffness;     ///< Ks that it takes without bound of the crossover; ideal valves.
  BorderPair crossover;     ///< contact_crossover_radps that the Ks of the file bears; ideal valves.
  std::optional<LoopCrossing> at_file;    ///< Predicted for that hold; one over its gain is the gain margin.
  std::optional<ContactMargins> margins;  ///< Likewise.
  HoldSwing on_file;                      ///< Valves and law as on file.
  MeasuredBorder crossover_on_file;       ///< Like crossover.measured, with valves as on file.
  [[nodiscard]] bool passed() const noexcept {
    return small_at_file.calm && on_file.calm && stiffness.within_bound() && crossover.within_bound();
  }
};

/// What a hold presses with: 1800 N, less where a wall would let other places of the bucket touch as well.
[[nodiscard]] ContactTrial trial_of(const MachineDescription& machine, const ContactCell& cell, Valves valves,
                                    std::uint64_t seed);
[[nodiscard]] ContactRow contact_row(const MachineDescription& machine, const ContactCell& cell, std::uint64_t seed);

void print_contact_rows(const std::vector<ContactRow>& rows, const MachineDescription& machine, std::ostream& out);
/// Described in docs/evaluation.md.
void write_contact_rows(const std::vector<ContactRow>& rows, const MachineDescription& machine, std::ostream& out);
/// Every hold calm as on file, and every border within the bound.
[[nodiscard]] bool all_passed(const std::vector<ContactRow>& rows);

}  // namespace knuckle::studies
