#include "app/studies/contact_sensitivity.h"

#include <cmath>
#include <functional>
#include <iomanip>

namespace knuckle::studies {
namespace {

struct Change {
  const char* name;
  std::function<void(MachineDescription&, ContactHold&, ContactNominal&)> make;
};

const std::vector<Change>& changes() {
  static const std::vector<Change> all{
      {"valve 10 ms later",
       [](auto& machine, auto&, auto&) {
         for (auto& cylinder : machine.cylinders) cylinder.valve.delay_s += 0.01;
       }},
      {"spools 20 Hz",
       [](auto& machine, auto&, auto&) {
         for (auto& cylinder : machine.cylinders) cylinder.valve.natural_frequency_Hz = 20;
       }},
      {"set-points every second SYNC", [](auto& machine, auto&, auto&) { machine.bus.set_point_every_nth_sync = 2; }},
      {"force at 12 Hz", [](auto&, auto&, auto& nominal) { nominal.force_band.observer_Hz = 12; }},
      {"Kp halved",
       [](auto& machine, auto&, auto&) {
         machine.control.position_gain_1ps /= 2;
         machine.control.bucket_position_gain_1ps /= 2;
       }},
      {"bound halved", [](auto& machine, auto&, auto&) { machine.control.contact_crossover_radps /= 2; }},
      {"oil half as stiff", [](auto& machine, auto&, auto&) { machine.hydraulics.bulk_modulus_Pa /= 2; }},
      {"the same, file unchanged", [](auto&, auto&, auto& nominal) { nominal.oil_share = 0.5; }},
      {"no air in the oil", [](auto&, auto&, auto& nominal) { nominal.air_share = 0; }},
      {"no seals", [](auto&, auto&, auto& nominal) { nominal.seal_N_per_m = 0; }},
      {"slides freely", [](auto&, auto& hold, auto&) { hold.sticks = false; }}};
  return all;
}

double gain_of(const MachineDescription& machine, const ContactHold& hold, const ContactNominal& nominal) {
  return ContactLoop(machine, hold, nominal).crossing().value_or(LoopCrossing{}).gain;
}

}  // namespace

void print_sensitivity(const MachineDescription& machine, const ContactCell& cell, std::uint64_t seed,
                       std::ostream& out) {
  const ContactTrial trial = trial_of(machine, cell, Valves::kIdeal, seed);
  const HoldSwing held = judge_hold(trial, run_contact(trial));
  out << cell.pose.name << ' ' << cell.wall_N_per_m << " N/m: ";
  if (!held.calm) {
    out << "does not hold still\n";
    return;
  }
  const double base = gain_of(trial.machine, held.hold, {});
  out << "gain " << std::setprecision(2) << base;
  for (const Change& change : changes()) {
    MachineDescription changed = trial.machine;
    ContactHold hold = held.hold;
    ContactNominal nominal;
    change.make(changed, hold, nominal);
    out << "; " << change.name << ' ' << std::showpos << std::lround(100 * (gain_of(changed, hold, nominal) / base - 1))
        << std::noshowpos << " %";
  }
  out << '\n';
}

}  // namespace knuckle::studies
