#include "app/battery/cell.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <random>

#include "app/battery/effects.h"
#include "app/cli/command.h"
#include "app/session/scenario.h"
#include "app/session/truth_file.h"
#include "core/error.h"
#include "core/text.h"
#include "machine/device_description.h"
#include "machine/load.h"
#include "sim/person.h"

namespace knuckle::battery {

namespace {

double most_felt_N(const session::Scenario& scenario) {
  double most = 0;
  for (const sim::Phase& phase : scenario.phases) {
    if (phase.kind == sim::PhaseKind::kPress) most = std::max(most, phase.force_N);
  }
  return most;
}

}  // namespace

Drawer::Drawer(const Settings& settings)
    : settings_(settings),
      machine_(load_machine(find_config("machine", settings.machine))),
      force_scale_(device_for(machine_, "").feel.force_scale) {
  const bool exact = settings.person == sim::name(sim::PersonClass::kExact);
  for (const std::string& name : settings.scenarios) {
    const std::string file = find_config("scenario", name);
    const session::Scenario scenario = session::load_scenario(file, calibrated(machine_));
    if (session::follows_recording(scenario))
      throw InputError(file + ": follows a recording, which a battery does not have");
    const double felt_N = most_felt_N(scenario);
    if (felt_N > sim::sustained_N(sim::LimbClass::kCoContracted) && !exact)
      throw InputError(file + ": asks for more than a person holds");
    most_felt_N_.push_back(exact ? 0 : felt_N);
  }
}

Cell Drawer::cell(std::uint64_t index) const {
  std::mt19937_64 random(stream_seed(stream_seed(settings_.seed, Stream::kCell) + index, Stream::kCell));
  Cell cell;
  cell.index = index;
  session::SimulateOptions& options = cell.options;
  options.judge = true;
  options.machine = settings_.machine;
  if (!settings_.commissioned.empty()) {
    const CommissionedMachine& machine = settings_.commissioned[index % settings_.commissioned.size()];
    options.machine = machine.file;
    options.machine_seed = machine.seed;
  }
  options.family = settings_.family;
  options.person = settings_.person;
  options.control = settings_.control;
  options.seed = 1 + pick(random, 1'000'000'000);
  const double rtt_ms = one_of(random, settings_.rtt_ms);
  options.delay_ms = rtt_ms / 2;
  options.jitter_ms = std::min(one_of(random, settings_.jitter_ms), rtt_ms / 2);
  options.loss = one_of(random, settings_.loss);
  options.bursts_per_s = one_of(random, settings_.bursts_per_s);
  cell.drawn = {{"seed", options.seed},
                {"rtt_ms", rtt_ms},
                {"jitter_ms", *options.jitter_ms},
                {"loss", *options.loss},
                {"bursts_per_s", *options.bursts_per_s}};
  if (options.machine_seed) cell.drawn["machine_seed"] = *options.machine_seed;
  const sim::MachineTruth truth =
      session::truth_for(machine_, "", settings_.family, options.machine_seed.value_or(options.seed));
  cell.effects = effects_of(truth);
  if (settings_.kind == Kind::kFeel) {
    options.scenario = fmt::format("feel_{}_{}", settings_.seed, index);
    draw_press(machine_, truth.hull, force_scale_, settings_, random, cell);
  } else {
    const std::size_t scenario = pick(random, settings_.scenarios.size());
    options.scenario = settings_.scenarios[scenario];
    sim::LimbClass limb = draw_limb(random);
    while (sim::sustained_N(limb) < most_felt_N_[scenario]) limb = draw_limb(random);
    options.operator_name = sim::name(limb);
    cell.drawn["scenario"] = options.scenario;
    cell.drawn["limb"] = options.operator_name;
  }
  return cell;
}

namespace {

/// Empty where the session could not run.
/// @throws InputError where the result has no row of it.
std::string digest_of_cell(const nlohmann::ordered_json& result, std::uint64_t index, const std::string& file) {
  for (const auto& row : result.value("rows", nlohmann::ordered_json::array())) {
    if (!row.is_object() || row.value("cell", nlohmann::ordered_json()) != index) continue;
    if (row.contains("refused")) return "";
    if (row.contains("digest") && row["digest"].is_string()) return row["digest"].get<std::string>();
  }
  throw InputError(fmt::format("{}: rows: has none of session {}, or one without its digest", file, index));
}

/// A machine's file of the battery is found from where the battery ran. @throws InputError
void check_machine_file(const std::string& machine, const std::string& file) {
  const std::string path = find_config("machine", machine);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    throw InputError(file + ": settings: machine = " + path +
                     ": is not there: run this in the folder in which the battery ran");
}

}  // namespace

session::SimulateOptions cell_of_result(const std::string& name) {
  const std::size_t colon = name.rfind(':');
  std::uint64_t index = 0;
  const char* const end = name.data() + name.size();
  const char* const digits = colon == std::string::npos ? end : name.data() + colon + 1;
  const auto [rest, error] = std::from_chars(digits, end, index);
  if (digits == end || error != std::errc() || rest != end)
    cli::refuse_option("--from-cell", name, "must be FILE:N, such as feel.json:17");
  const std::string file = name.substr(0, colon);
  cli::check_readable("--from-cell", file);
  std::ifstream stream(file, std::ios::binary);
  const auto json = nlohmann::ordered_json::parse(stream, nullptr, false);
  if (json.is_discarded()) throw InputError(file + ": is not complete JSON");
  if (!json.is_object() || !json.contains("settings") ||
      json.value("schema", nlohmann::ordered_json()) != kResultSchema)
    throw InputError(file + ": is not a result of knuckle-studies sweep --battery feel or work");
  const Settings settings = settings_of(json["settings"], file);
  if (index >= settings.sessions)
    cli::refuse_option("--from-cell", name, fmt::format("the battery has sessions 0 to {}", settings.sessions - 1));
  if (!settings.control.empty() && !control_law_named(settings.control))
    throw InputError(file + ": settings: control = " + shortened(settings.control) + ": " + kControlLawChoice);
  check_machine_file(settings.machine, file);
  for (const CommissionedMachine& machine : settings.commissioned) check_machine_file(machine.file, file);
  session::SimulateOptions cell = Drawer(settings).cell(index).options;
  cell.from_cell = name;
  cell.cell_digest = digest_of_cell(json, index, file);
  return cell;
}

}  // namespace knuckle::battery
