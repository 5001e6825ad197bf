// Any text as a machine, device, scenario and link file: refused in one line, or a description that holds what it
// promises.
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "app/session/link_file.h"
#include "app/session/scenario.h"
#include "machine/bus_budget.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "tests/fuzz/file_in_memory.h"
#include "tests/fuzz/require.h"
#include "transport/impaired_link.h"

namespace {

using knuckle::test::refused_or;
using knuckle::test::require;

void check_machine(std::string_view text) {
  const knuckle::MachineDescription machine = knuckle::parse_machine(text, "input");
  require(!machine.name.empty());
  const double load = knuckle::worst_bus_load(machine.bus);
  require(load >= 0 && load <= 1);
  const knuckle::Kinematics kinematics(machine);
  for (int joint = 0; joint < knuckle::kJoints; ++joint) {
    const knuckle::LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
    for (const double angle : {link.min_rad, 0.5 * (link.min_rad + link.max_rad), link.max_rad}) {
      const auto state = kinematics.cylinder_at(joint, angle);
      require(state && std::isfinite(state->length_m) && std::isfinite(state->lever_m) && state->lever_m != 0);
    }
  }
}

void check_scenario(const std::string& path) {
  static const knuckle::MachineDescription machine =
      knuckle::load_machine(KNUCKLE_SOURCE_DIR "/config/machines/solar015.toml");
  const knuckle::session::Scenario scenario = knuckle::session::load_scenario(path, machine);
  require(!scenario.phases.empty() && scenario.phases.size() == scenario.phase_names.size());
  require(scenario.start_rad.allFinite() && scenario.hand_rad.allFinite());
  require(std::isfinite(scenario.duration_s) && std::isfinite(scenario.delay_ms));
  for (const knuckle::session::ScheduledFault& fault : scenario.faults) {
    require(fault.phase >= 0 && static_cast<std::size_t>(fault.phase) < scenario.phases.size());
    require(std::isfinite(fault.after_s) && std::isfinite(fault.duration_s));
  }
}

/// What a file promises holds for every datagram: it arrives when it was sent or later, a bounded number of times.
void check_link(std::string_view text) {
  const knuckle::session::LinkFile file = knuckle::session::parse_link(text, "input");
  for (const knuckle::LinkImpairment* way : {&file.to_machine, &file.to_operator}) {
    knuckle::ImpairmentModel model(*way, 1);
    for (int i = 0; i < 200; ++i) {
      const knuckle::Time now(i * std::chrono::milliseconds(i));
      const auto fate = model.send(150, now);
      require(fate.copies <= fate.arrivals.size());
      for (std::size_t copy = 0; copy < fate.copies; ++copy)
        require(fate.arrivals[copy] >= now && fate.arrivals[copy] < now + std::chrono::hours(24 * 365));
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const knuckle::test::FileInMemory file(text);
  refused_or([&] { check_machine(text); });
  refused_or([&] { (void)knuckle::load_device(file.path()); });
  refused_or([&] { check_scenario(file.path()); });
  refused_or([&] { check_link(text); });
  return 0;
}
