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
  kWave,        ///< wave variables over a constant-delay buffer
  kTdpa,        ///< force computed from positions, with passivity observer and controller at the hand
  kCues,        ///< no force: contact, overload and load are signalled
  kDirect,      ///< raw force reflection: unstable over delay, kept as the cautionary baseline
};
inline constexpr std::array<const char*, 5> kControlLawNames{"echo", "wave", "tdpa", "cues", "direct"};
inline constexpr const char* kControlLawChoice = "echo, wave, tdpa, cues or direct";

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

}  // namespace knuckle
