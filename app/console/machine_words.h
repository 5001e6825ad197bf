// What may be said of the machine from what it reports, and what must not be: a force without confidence is no force, a
// joint at its end is no contact, and a limit has a joint and a direction.
#pragma once

#include <string>
#include <vector>

#include "app/console/console_view.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "master/downgrade.h"

namespace knuckle::console {

/// Below, nothing is felt either, and what is shown are dashes.
inline constexpr double kLeastConfidence = 1 - master::Downgrade::kDoubt.on;

struct ForceWords {
  bool known = false;    ///< Else no number, no arrow, no contact.
  bool contact = false;  ///< Only where known.
  const char* contact_word = "Not known";
};
[[nodiscard]] ForceWords force_words(const ConsoleView& view) noexcept;

/// "boom up", "bucket in (curl)"; a joint turns up or out where its angle grows.
[[nodiscard]] std::string direction_words(int joint, bool angle_grows);

/// Which chambers are as full as the relief valve lets them be: the joint pushes, and cannot push harder.
[[nodiscard]] bool at_relief(const HydraulicsDescription& hydraulics, double pressure_Pa) noexcept;
/// For each limit being hit, joint at the end of its range, and cylinder at relief: a few words that name joint and
/// direction where they are known. Empty: none.
/// @param measured whether pose and pressures are fresh.
[[nodiscard]] std::vector<std::string> limits_in_words(const ConsoleView& view, const MachineDescription& machine,
                                                       const Kinematics& kinematics, bool measured);

}  // namespace knuckle::console
