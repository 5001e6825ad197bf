#include "app/battery/cell.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <random>

#include "app/battery/draw.h"
#include "app/battery/effects.h"
#include "app/battery/feel_cell.h"
#include "app/session/scenario.h"
#include "app/session/truth_file.h"
#include "core/error.h"
#include "machine/device_choice.h"
#include "machine/load.h"
#include "sim/person.h"

namespace knuckle::battery {

struct Drawer::Impl {
  Settings settings;
  MachineDescription machine;       ///< As drawn.
  double force_scale = 0;           ///< Hand newtons per machine newton, of its device.
  std::vector<double> most_felt_N;  ///< That a person is asked to hold, by scenario.
};

namespace {

double most_felt_N(const session::Scenario& scenario) {
  double most = 0;
  for (const sim::Phase& phase : scenario.phases) {
    if (phase.kind == sim::PhaseKind::kPress) most = std::max(most, phase.force_N);
  }
  return most;
}

}  // namespace

Drawer::Drawer(const Settings& settings) : impl_(std::make_unique<Impl>()) {
  impl_->settings = settings;
  impl_->machine = load_machine(find_config("machine", settings.machine));
  impl_->force_scale = device_for(impl_->machine, "").feel.force_scale;
  const bool exact = settings.person == sim::name(sim::PersonClass::kExact);
  for (const std::string& name : settings.scenarios) {
    const std::string file = find_config("scenario", name);
    const session::Scenario scenario = session::load_scenario(file, calibrated(impl_->machine));
    if (session::follows_recording(scenario))
      throw InputError(file + ": follows a recording, which a battery does not have");
    const double felt_N = most_felt_N(scenario);
    if (felt_N > sim::sustained_N(sim::LimbClass::kCoContracted) && !exact)
      throw InputError(file + ": asks for more than a person holds");
    impl_->most_felt_N.push_back(exact ? 0 : felt_N);
  }
}

Drawer::~Drawer() = default;

const Settings& Drawer::settings() const noexcept {
  return impl_->settings;
}

Cell Drawer::cell(std::uint64_t index) const {
  const Settings& settings = impl_->settings;
  std::mt19937_64 random(stream_seed(stream_seed(settings.seed, Stream::kCell) + index, Stream::kCell));
  Cell cell;
  cell.index = index;
  session::SimulateOptions& options = cell.options;
  options.judge = true;
  options.machine = settings.machine;
  if (!settings.commissioned.empty()) {
    const CommissionedMachine& machine = settings.commissioned[index % settings.commissioned.size()];
    options.machine = machine.file;
    options.machine_seed = machine.seed;
  }
  options.family = settings.family;
  options.person = settings.person;
  options.control = settings.control;
  options.seed = 1 + pick(random, 1'000'000'000);
  const double rtt_ms = one_of(random, settings.rtt_ms);
  options.delay_ms = rtt_ms / 2;
  options.jitter_ms = std::min(one_of(random, settings.jitter_ms), rtt_ms / 2);
  options.loss = one_of(random, settings.loss);
  options.bursts_per_s = one_of(random, settings.bursts_per_s);
  cell.drawn = {{"seed", options.seed},
                {"rtt_ms", rtt_ms},
                {"jitter_ms", *options.jitter_ms},
                {"loss", *options.loss},
                {"bursts_per_s", *options.bursts_per_s}};
  if (options.machine_seed) cell.drawn["machine_seed"] = *options.machine_seed;
  const sim::MachineTruth truth =
      session::truth_for(impl_->machine, "", settings.family, options.machine_seed.value_or(options.seed));
  cell.effects = effects_of(truth);
  if (settings.kind == Kind::kFeel) {
    options.scenario = fmt::format("feel_{}_{}", settings.seed, index);
    draw_press(impl_->machine, truth.hull, impl_->force_scale, settings, random, cell);
  } else {
    const std::size_t scenario = pick(random, settings.scenarios.size());
    options.scenario = settings.scenarios[scenario];
    sim::LimbClass limb = draw_limb(random);
    while (sim::sustained_N(limb) < impl_->most_felt_N[scenario]) limb = draw_limb(random);
    options.operator_name = sim::name(limb);
    cell.drawn["scenario"] = options.scenario;
    cell.drawn["limb"] = options.operator_name;
  }
  return cell;
}

}  // namespace knuckle::battery
