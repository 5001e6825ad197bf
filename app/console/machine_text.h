// What may be said of the machine from what it reports, and what must not be: a force without confidence is no force, a
// joint at its end is no contact, and a limit has a joint and a direction.
#pragma once

#include <string>
#include <vector>

#include "app/console/console_view.h"
#include "app/console/hand_input.h"
#include "app/console/joint_load.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "master/felt_law.h"

namespace knuckle::console {

/// Below, nothing of the machine's force is felt either, and what is shown are dashes.
inline constexpr double kLeastConfidence = 1 - master::Downgrade::kDoubt.on;

struct ForceText {
  bool known = false;    ///< Else no number, no arrow, no contact.
  bool contact = false;  ///< Only where known.
  const char* contact_word = "Not known";
};
[[nodiscard]] ForceText force_text(const ConsoleView& view) noexcept;

/// "boom up", "bucket in (curl)"; a joint turns up or out where its angle grows.
[[nodiscard]] std::string direction_text(int joint, bool angle_grows);

/// Why the machine does not follow, or no longer does, in terms of what this person has in hand.
[[nodiscard]] std::string reason_text(const Reason& reason, const BusDescription& bus, HandSource hand);

/// What is known of a force that is not: that a joint presses all the same, by its oil.
struct BlindPress {
  double least_N = 0;  ///< It is at least so much.
  std::string text;    ///< "pressing hard; cannot be measured: arm at relief"; empty: nothing presses, or it is known.
};
/// @param loads marked by a PushWatch.
[[nodiscard]] BlindPress blind_press(const ConsoleView& view, const JointLoads& loads);

/// What a machine that nobody leads goes on pressing with, its oil being shut in: "the bucket still presses with 800
/// N", or, where the force is not known, "still pressing: arm 220 bar". Empty: it does not.
/// @param loads marked by a PushWatch.
[[nodiscard]] std::string still_pressing(const ConsoleView& view, const JointLoads& loads);
/// The same where it pushes against the end of its own joint: "oil shut in, bucket 205 bar".
[[nodiscard]] std::string shut_in(const ConsoleView& view, const JointLoads& loads);
/// "bucket in (curl): at its end" for each joint that is; empty: none.
[[nodiscard]] std::vector<std::string> end_texts(const JointLoads& loads);

/// Why the hand feels less than the machine while it leads it.
struct LessFelt {
  std::string brief, text;  ///< Empty: it does not.
};
[[nodiscard]] LessFelt less_felt(const ConsoleView& view);
/// The hand's set-point is in the wall that is felt at the end of a joint's range.
[[nodiscard]] bool feels_end_of_range(const ConsoleView& view, const MachineDescription& machine) noexcept;

/// A piece that broke off or fell within the last seconds of a simulated session; empty: none did.
[[nodiscard]] std::string piece_news(const ConsoleView& view);

/// For each limit being hit, joint at the end of its way, and cylinder at relief: a few words that name joint and
/// direction where they are known. Empty: none.
/// @param measured whether pose and pressures are fresh. @param loads then.
[[nodiscard]] std::vector<std::string> limit_texts(const ConsoleView& view, const MachineDescription& machine,
                                                   const Kinematics& kinematics, const JointLoads& loads,
                                                   bool measured);

/// Of a console that did not run, and what to do.
[[nodiscard]] std::string own_pause_text(double seconds);

}  // namespace knuckle::console
