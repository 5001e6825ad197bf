// The bilateral laws by name, as device files and --control name them. What each does: docs/theory.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace knuckle {

enum class ControlLaw : std::uint8_t {
  kEchoSpring,  ///< the default: a local spring, corrected by what comes back
  kCues,        ///< no force: contact, overload and load are signalled
  kDirect,      ///< raw force reflection: unstable over delay, a baseline for simulated sessions that leads no machine
};
inline constexpr std::array<const char*, 3> kControlLawNames{"echo", "cues", "direct"};
inline constexpr const char* kControlLawChoice = "must be echo, cues or direct";
inline constexpr const char* kLeadingLawChoice = "must be echo or cues: no other law leads a machine";

[[nodiscard]] constexpr const char* name(ControlLaw law) noexcept {
  return kControlLawNames[static_cast<std::size_t>(law)];
}
/// nullopt: no such law.
[[nodiscard]] constexpr std::optional<ControlLaw> control_law_named(std::string_view name) noexcept {
  for (std::size_t i = 0; i < kControlLawNames.size(); ++i) {
    if (name == kControlLawNames[i]) return static_cast<ControlLaw>(i);
  }
  return std::nullopt;
}
/// nullopt: no such law, or one that leads no machine.
[[nodiscard]] constexpr std::optional<ControlLaw> leading_law_named(std::string_view name) noexcept {
  const auto law = control_law_named(name);
  return law == ControlLaw::kDirect ? std::nullopt : law;
}

}  // namespace knuckle
