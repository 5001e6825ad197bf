#include "app/bringup/commission_bus.h"

#include <memory>

#include "app/bringup/doctor_command.h"
#include "machine/description.h"
#include "slave/bus_listen.h"
#include "transport/can_buses.h"

namespace knuckle::bringup {
namespace {

/// One of the machine's buses, as if there were no other.
BusAccess access_to_one(BusAccess& access, std::size_t which) {
  return {access.name(), std::make_shared<OneOfBuses>(access.bus(), which), [&access](Time due) {
            access.wait_until(due);
            return access.now();
          }};
}

}  // namespace

void alone_on_bus(const MachineDescription& machine, BusAccess& access) {
  const std::string heard = slave::heard_of_other_controller(machine.bus, access);
  if (!heard.empty())
    throw CommissionEnded("another controller is on the bus: heard " + heard + "; nothing was configured or moved");
}

BusDiagnosis sound_bus(const MachineDescription& machine, BusAccess& access, Dialogue& dialogue,
                       const std::function<void()>& check) {
  alone_on_bus(machine, access);
  std::vector<BusAccess> each;
  for (std::size_t on = 0; on < machine.bus.lines(); ++on) each.push_back(access_to_one(access, on));
  BusDiagnosis diagnosis = together(diagnose_each(each, machine, {}, check), machine.bus);
  for (const std::string& line : diagnosis_lines(diagnosis)) dialogue.say(line);
  if (!healthy(diagnosis.findings))
    throw CommissionEnded("the bus has faults (see FAULT); nothing was configured or moved");
  return diagnosis;
}

}  // namespace knuckle::bringup
