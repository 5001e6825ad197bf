#include "slave/bus_listen.h"

#include <algorithm>
#include <set>
#include <vector>

#include "core/error.h"
#include "core/frame_words.h"
#include "machine/description.h"
#include "machine/reason_text.h"
#include "slave/bus_map.h"

namespace knuckle::slave {
namespace {

constexpr double kPeriods = 3;  // two, wherever between two frames it begins

std::string frame_text(std::uint32_t id, const BusDescription& bus) {
  for (const CommandFrame& frame : bus.commands)
    if (frame.filter().lets(id)) return frame.name + " " + id_text(id) + bus_text(id, bus);
  return controllers_frame_text(id);
}

}  // namespace

std::string heard_of_other_controller(const BusDescription& bus, BusAccess& access) {
  const std::vector<std::uint32_t> own = controllers_own(bus);
  std::vector<CanFilter> watched = set_point_filters(bus);
  watched.insert(watched.end(), own.begin(), own.end());
  std::set<std::uint32_t> heard;
  double longest_s = std::max(bus.controller_heartbeat_s, 1 / bus.sync_Hz);
  for (const CommandFrame& frame : bus.commands) longest_s = std::max(longest_s, frame.period_s);
  const Duration longest = from_seconds(kPeriods * longest_s);
  for (const Time end = access.now() + longest; access.now() < end;) {
    access.wait_until(access.now() + 1ms);
    CanFrame frame;
    for (int i = 0; i < kMostFramesPerStep && access.bus().receive(frame); ++i) {
      if (hears(watched, frame.id)) heard.insert(frame.id);
    }
  }
  std::string text;
  for (const std::uint32_t id : heard) text += (text.empty() ? "" : ", ") + frame_text(id, bus);
  return text;
}

void refuse_other_controller(const BusDescription& bus, BusAccess& access) {
  if (heard_of_other_controller(bus, access).empty()) return;
  // Frames that a program left in the interface's queue when it was killed come once; who leads a machine goes on.
  const std::string heard = heard_of_other_controller(bus, access);
  if (heard.empty()) return;
  throw InputError(access.name() + ": another controller is on the bus: heard " + heard +
                   "; stop it, then start again");
}

void refuse_unidentified(const MachineDescription& machine) {
  const int without = machine.sensors.without_pressures;
  if (without == SensorDescription::kNone || machine.dynamics_calibration) return;
  throw InputError(
      machine.source + ": key 'sensors.without_pressures' = \"" + kJointNames[static_cast<std::size_t>(without)] +
      "\": by a drawing the two other cylinders do not tell contacts well enough: give the calibrated file that "
      "knuckle identify writes of what knuckle commission records");
}

}  // namespace knuckle::slave
