#include "app/bringup/commission_bus.h"

#include <memory>

#include "app/bringup/doctor_command.h"
#include "machine/description.h"
#include "slave/bus_listen.h"
#include "transport/can_buses.h"

namespace knuckle::bringup {
namespace {

BusDiagnosis diagnosis_of(const MachineDescription& machine, BusAccess& access, const std::function<void()>& check) {
  return diagnose(survey_bus(access, machine.bus.bit_rate, doctor_objects(machine),
                             {.multiplexed = multiplexed_frames(machine.bus)}, check),
                  &machine);
}

/// One of the machine's two buses, as if there were no other.
BusAccess access_to_one(BusAccess& access, std::size_t which) {
  return {access.name(), std::make_shared<OneOfBuses>(access.bus(), which), [&access](Time due) {
            access.wait_until(due);
            return access.now();
          }};
}

BusDiagnosis diagnosis_of_all(const MachineDescription& machine, BusAccess& access,
                              const std::function<void()>& check) {
  if (!machine.bus.second) return diagnosis_of(machine, access, check);
  BusDiagnosis all;
  for (std::size_t which = 0; which < machine.bus.lines(); ++which) {
    MachineDescription one = machine;
    one.bus = machine.bus.alone(which);
    BusAccess alone = access_to_one(access, which);
    const BusDiagnosis found = diagnosis_of(one, alone, check);
    if (which == 0)
      all = found;
    else
      add_bus(all, found, one.bus.name);
  }
  return all;
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
  BusDiagnosis diagnosis = diagnosis_of_all(machine, access, check);
  for (const std::string& line : diagnosis_lines(diagnosis)) dialogue.say(line);
  if (!healthy(diagnosis.findings))
    throw CommissionEnded("the bus has faults (see FAULT); nothing was configured or moved");
  return diagnosis;
}

}  // namespace knuckle::bringup
