// Which of the papers' force models, or Knuckle's own, answers "what acts on the bucket?": a choice of the machine
// file. Equations and limits: docs/theory.md, "Contact models".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/joints.h"

namespace knuckle {

enum class ContactModel : std::uint8_t { kBucketForce, kTipWrench, kTipForceOfTwo, kForceAndPosition };
inline constexpr std::array kContactModelNames{"bucket_force", "tip_wrench", "tip_force_of_two", "force_and_position"};
inline constexpr const char* kContactModelChoice =
    "must be bucket_force, tip_wrench, tip_force_of_two or force_and_position";

[[nodiscard]] constexpr const char* name(ContactModel model) noexcept {
  return kContactModelNames[static_cast<std::size_t>(model)];
}
[[nodiscard]] inline std::optional<ContactModel> contact_model_named(std::string_view name) noexcept {
  for (std::size_t i = 0; i < kContactModelNames.size(); ++i)
    if (name == kContactModelNames[i]) return static_cast<ContactModel>(i);
  return std::nullopt;
}

[[nodiscard]] constexpr unsigned number_of_words(ContactModel) noexcept {
  return kContactModelNames.size();
}

/// Joints whose cylinder pressures the model cannot do without. bucket_force takes any two.
[[nodiscard]] constexpr PerJoint<bool> needs_pressures(ContactModel model) noexcept {
  const bool all = model == ContactModel::kTipWrench, two = model != ContactModel::kBucketForce;
  return {all, two, two};
}

/// Where `force_and_position` gets its direction from.
enum class ForceDirection : std::uint8_t { kAgainstMotion, kPlumb, kFixed };

/// `[force]` of a machine file.
struct ForceDescription {
  ContactModel contact_model = ContactModel::kBucketForce;
  ForceDirection direction = ForceDirection::kAgainstMotion;
  PlanarVector fixed_direction = PlanarVector::Zero();  ///< Frame M, of any length; with kFixed.
};

}  // namespace knuckle
