#include "slave/bus_listen.h"

#include <algorithm>
#include <set>
#include <vector>

#include "core/error.h"
#include "core/frame_words.h"
#include "machine/description.h"
#include "slave/bus_map.h"

namespace knuckle::slave {
namespace {

constexpr double kPeriods = 3;  // two, wherever between two frames it begins

}  // namespace

std::string heard_of_other_controller(const BusDescription& bus, BusAccess& access) {
  std::vector<std::uint32_t> watched = controllers_own(bus);
  const std::vector<std::uint32_t> set_points = set_point_ids(bus);
  watched.insert(watched.end(), set_points.begin(), set_points.end());
  std::set<std::uint32_t> heard;
  const Duration longest = from_seconds(kPeriods * std::max(bus.controller_heartbeat_s, 1 / bus.sync_Hz));
  for (const Time end = access.now() + longest; access.now() < end;) {
    access.wait_until(access.now() + 1ms);
    CanFrame frame;
    for (int i = 0; i < kMostFramesPerStep && access.bus().receive(frame); ++i) {
      if (std::find(watched.begin(), watched.end(), frame.id) != watched.end()) heard.insert(frame.id);
    }
  }
  std::string text;
  for (const std::uint32_t id : heard) text += (text.empty() ? "" : ", ") + controllers_frame_text(id);
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

void refuse_broadcasts(const MachineDescription& machine) {
  if (machine.bus.broadcasts.empty()) return;
  throw InputError(machine.source + ": key 'bus.broadcast': " + machine.bus.broadcasts.front().name +
                   ": only machines whose sensors are all CANopen nodes can be commissioned and recovered so far: set "
                   "zero_rad and sign of its signals by hand, then use knuckle slave");
}

}  // namespace knuckle::slave
