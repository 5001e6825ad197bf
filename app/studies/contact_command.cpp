#include "app/studies/contact_command.h"

#include <algorithm>
#include <array>
#include <iostream>
#include <memory>
#include <optional>

#include "app/cli/output_file.h"
#include "app/cli/progress.h"
#include "app/identify/parallel.h"
#include "app/studies/contact_impact.h"
#include "app/studies/contact_sensitivity.h"
#include "machine/load.h"

namespace knuckle::studies {
namespace {

constexpr std::array<double, 5> kWalls_N_per_m{1e4, 1e5, 1e6, 1e7, 1e8};

struct Options {
  std::string machine = "solar015", json;
  std::vector<std::string> poses;
  std::vector<double> walls_N_per_m;
  std::uint64_t seed = 1;
  int jobs = 0;
  bool impact = false, sensitivity = false;
};

std::vector<ContactCell> cells_of(const Options& options, const MachineDescription& machine) {
  const std::vector<ContactPose> poses = contact_poses(machine);
  for (const std::string& name : options.poses) {
    const bool known = std::any_of(poses.begin(), poses.end(), [&](const ContactPose& p) { return p.name == name; });
    if (!known) cli::refuse_option("--pose", name, "must be front, ground, tilted, overhead, pull or back");
  }
  for (const double wall : options.walls_N_per_m) cli::check_range("--wall", wall, 1e3, 1e9, " N/m");
  std::vector<double> walls = options.walls_N_per_m;
  if (walls.empty()) walls.assign(kWalls_N_per_m.begin(), kWalls_N_per_m.end());
  std::vector<ContactCell> cells;
  for (const ContactPose& pose : poses) {
    const auto& asked = options.poses;
    if (!asked.empty() && std::find(asked.begin(), asked.end(), pose.name) == asked.end()) continue;
    for (const double wall : walls) cells.push_back({pose, wall});
  }
  return cells;
}

int run_impacts(const Options& options, const MachineDescription& machine, const std::vector<ContactCell>& cells) {
  constexpr std::array<double, 2> kSpeeds_mps{0.1, 0.2}, kPresses_N{600, 1000};
  std::vector<Impact> impacts;
  for (const ContactCell& cell : cells) {
    for (const double speed_mps : kSpeeds_mps) {
      for (const double press_N : kPresses_N) {
        impacts.push_back(run_impact(machine, cell, speed_mps, press_N, options.seed));
      }
    }
  }
  print_impacts(impacts, std::cout);
  return 0;
}

int run(const Options& options) {
  cli::Places places;
  places.configuration("--machine", options.machine);
  places.output("--json", options.json);
  if (options.impact && options.sensitivity) cli::refuse_option("--impact", "", "does not go with --sensitivity");
  if ((options.impact || options.sensitivity) && !options.json.empty()) {
    cli::refuse_option("--json", options.json, "does not go with --impact and --sensitivity");
  }
  const MachineDescription machine = load_machine(find_config("machine", options.machine));
  const std::vector<ContactCell> cells = cells_of(options, machine);
  if (options.sensitivity) {
    for (const ContactCell& cell : cells) print_sensitivity(machine, cell, options.seed, std::cout);
    return 0;
  }
  if (options.impact) return run_impacts(options, machine, cells);
  std::optional<cli::OutputFile> json;
  if (!options.json.empty()) json.emplace("--json", options.json);
  std::vector<ContactRow> rows(cells.size());
  const cli::InterruptGuard interrupt;
  cli::watched(interrupt, "contact loop", [&](const auto& progress) {
    identify::parallel_for(
        cells.size(), options.jobs, [&](std::size_t i) { rows[i] = contact_row(machine, cells[i], options.seed); },
        progress);
    return 0;
  });
  if (json) {
    write_contact_rows(rows, machine, json->stream());
    json->commit();
  }
  if (!cli::is_standard_output(options.json)) {
    print_contact_rows(rows, machine, std::cout);
  }
  return all_passed(rows) ? 0 : 1;
}

}  // namespace

cli::Command contact_loop_entry() {
  return {"contact-loop", "Measure the borders of the machine's contact loop, and predict them by a linear model",
          [](const cli::OptionList& command) {
            const auto o = std::make_shared<Options>();
            command.add_option("--machine", o->machine, "Machine: name or .toml file").show_default();
            command.add_option("--pose", o->poses,
                               "Only these poses: front, ground, tilted, overhead, pull, back (default: all)");
            command.add_option("--wall", o->walls_N_per_m, "Stiffness of the walls in N/m (default: 1e4 to 1e8)");
            command.add_option("--seed", o->seed, "Seed of the sensors' noise").check(cli::seed_error);
            command.add_option("--jobs", o->jobs, "Threads, up to 1024; 0: one per processor")
                .show_default()
                .check(cli::count_within(0, 1024));
            command.add_flag("--impact", o->impact,
                             "Instead: what follows touches at 0.1 and 0.2 m/s, the machine as on file");
            command.add_flag(
                "--sensitivity", o->sensitivity,
                "Instead: by how much single changes of the machine change the predicted gain of the loop");
            command.add_option("--json", o->json, "Write the rows as JSON (described in docs/evaluation.md)");
            return [o] { return run(*o); };
          }};
}

}  // namespace knuckle::studies
