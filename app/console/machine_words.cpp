#include "app/console/machine_words.h"

#include <algorithm>
#include <array>

namespace knuckle::console {
namespace {

constexpr double kEnd_rad = 0.009;  // half a degree: as well as joints are measured
constexpr double kReliefShare = 0.97;

/// +1, -1: the angle's end that the joint is within `margin_rad` of; 0: neither.
int end_of_range(const LinkDescription& link, double angle_rad, double margin_rad) {
  if (angle_rad > link.max_rad - margin_rad) return 1;
  return angle_rad < link.min_rad + margin_rad ? -1 : 0;
}

}  // namespace

ForceWords force_words(const ConsoleView& view) noexcept {
  const SlaveMessage& m = view.machine;
  if (!view.link.heard || !(m.confidence > kLeastConfidence)) return {};
  return {true, m.contact, m.contact ? "In contact" : "No contact"};
}

std::string direction_words(int joint, bool angle_grows) {
  static constexpr std::array<std::array<const char*, 2>, kJoints> kWords{
      {{"boom down", "boom up"}, {"arm in", "arm out"}, {"bucket in (curl)", "bucket out"}}};
  return kWords[static_cast<std::size_t>(joint)][angle_grows ? 1 : 0];
}

bool at_relief(const HydraulicsDescription& hydraulics, double pressure_Pa) noexcept {
  return pressure_Pa >= kReliefShare * std::min(hydraulics.main_relief_Pa, hydraulics.port_relief_Pa);
}

std::vector<std::string> limits_in_words(const ConsoleView& view, const MachineDescription& machine,
                                         const Kinematics& kinematics, bool measured) {
  if (!view.link.heard) return {};
  const SlaveMessage& m = view.machine;
  std::vector<std::string> words;
  bool range_named = false;
  for (int joint = 0; measured && joint < kJoints; ++joint) {
    const auto i = static_cast<std::size_t>(joint);
    const LinkDescription& link = machine.links[i];
    const double angle_rad = m.position_rad[joint];
    const bool limited = (m.limits & kLimitJointRange) != 0;
    if (const int end = end_of_range(link, angle_rad, kEnd_rad); end != 0) {
      words.push_back(direction_words(joint, end > 0) + ": end stop");
      range_named |= limited;
    } else if (const int near = end_of_range(link, angle_rad, machine.limits.joint_soft_margin_rad);
               limited && near != 0) {
      words.push_back(direction_words(joint, near > 0) + ": joint range");
      range_named = true;
    }
    const auto cylinder = kinematics.cylinder_at(joint, angle_rad);
    for (std::size_t side = 0; cylinder && side < 2; ++side) {
      if (!at_relief(machine.hydraulics, m.pressure_Pa[2 * i + side])) continue;
      const bool extends = side == 0;
      words.push_back(direction_words(joint, extends == (cylinder->lever_m > 0)) + ": oil at relief");
    }
  }
  for (unsigned bit = 0; limit_word(bit) != nullptr; ++bit) {
    const bool named = (1U << bit) == kLimitJointRange && range_named;
    if ((m.limits & (1U << bit)) != 0 && !named) words.emplace_back(limit_word(bit));
  }
  return words;
}

}  // namespace knuckle::console
