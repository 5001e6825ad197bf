#include <fmt/format.h>

#include <algorithm>

#include "app/bringup/doctor_bus.h"
#include "machine/bus_frames.h"
#include "machine/description.h"
#include "slave/bus_watch.h"

namespace knuckle::bringup {
namespace {

using Level = Finding::Level;
using slave::BusWatch;

struct Signs {
  int count = 0;
  bool counts = false;  ///< One of them is a number of frames.
  std::string text;
  void add(int signs, const std::string& what) {
    count += signs;
    text += (text.empty() ? "" : "; ") + what;
  }
};

/// More frames under an identifier than are due: a sign, and enough where they are far too many.
/// @param by_change a frame that is not as the one before it was sent for that
void judge_count(Signs& signs, const BusSurvey& survey, std::uint32_t id, double due, bool by_change = false) {
  const auto heard = survey.heard.find(id);
  if (heard == survey.heard.end()) return;
  const double most_over = by_change ? BusWatch::kMostOverWithEvents : BusWatch::kMostOver;
  const double frames = static_cast<double>(by_change ? heard->second.repeated : heard->second.count);
  const double over = frames - due * (1 + BusWatch::kSpareByClock);
  if (over <= most_over / 2) return;
  signs.counts = true;
  signs.add(over > most_over ? 2 : 1,
            fmt::format("{:.0f} frames 0x{:03X} in {:.1f} s where {:.0f} are due", frames, id, survey.listened_s, due));
}

/// What holds up one frame of a node's data holds up all: they are one sign together.
void add_data(Signs& signs, const BusSurvey& survey, const MachineDescription& machine, const SurveyedNode& node,
              const NodeDescription& expected) {
  const auto syncs = survey.heard.find(canopen::kSyncId);
  const double sync_count = syncs == survey.heard.end() ? 0 : static_cast<double>(syncs->second.count);
  const bool by_change = expected.id == machine.bus.enable().id;
  Signs worst;
  for (const BusFrame& frame : bus_frames(machine.bus)) {
    if (frame.to_node || machine.bus.nodes[frame.node].id != expected.id) continue;
    const auto parameters = static_cast<std::uint16_t>(canopen::kTpdo1CobId.index + frame.pdo);
    const std::uint32_t type = node.value({parameters, 2}).value_or(0);
    const std::uint32_t timer_ms = node.value({parameters, 5}).value_or(0);
    Signs one;
    if (type >= 1 && type <= 240)
      judge_count(one, survey, frame.id, sync_count / type, by_change);
    else if (timer_ms > 0)
      judge_count(one, survey, frame.id, 1e3 * survey.listened_s / timer_ms, by_change);
    if (one.count > worst.count) worst = one;
  }
  if (worst.count == 0) return;
  signs.counts = true;
  signs.add(worst.count, worst.text);
}

}  // namespace

std::optional<Finding> second_device(const BusSurvey& survey, const MachineDescription& machine,
                                     const SurveyedNode& node, const NodeDescription& expected,
                                     const std::string& about) {
  Signs signs;
  if (node.second_answers > 0)
    signs.add(std::min(node.second_answers, 2), fmt::format("{} of its answers came once more", node.second_answers));
  if (node.contradicts_itself()) signs.add(1, "its identity changed between two reads");
  if (const auto period_ms = node.value(canopen::kProducerHeartbeat); period_ms.value_or(0) > 0)
    judge_count(signs, survey, canopen::heartbeat_id(node.id), 1e3 * survey.listened_s / *period_ms);
  add_data(signs, survey, machine, node, expected);
  // One disturbance makes an error frame and has a frame sent again: both are one sign.
  if (signs.counts && survey.errors > 0)
    signs.add(1, fmt::format("{} errors on the bus, as where two devices send at once", survey.errors));
  if (signs.count == 0) return std::nullopt;
  const bool fault = signs.count >= 2;
  return Finding{fault ? Level::kFault : Level::kNote, about,
                 (fault ? "two devices have this node id (" : "possibly two devices have this node id (") + signs.text +
                     "): take one off the bus, or give it another id"};
}

std::optional<Finding> second_controller(const BusSurvey& survey, const MachineDescription& machine,
                                         const std::string& about) {
  Signs signs;
  judge_count(signs, survey, canopen::heartbeat_id(machine.bus.controller_id),
              survey.listened_s / machine.bus.controller_heartbeat_s);
  if (signs.count < 2) return std::nullopt;
  return Finding{Level::kFault, about, "two controllers are on the bus (" + signs.text + "): stop one of the two"};
}

}  // namespace knuckle::bringup
