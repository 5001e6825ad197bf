#include "app/studies/contact_impact.h"

#include <algorithm>
#include <cmath>
#include <iomanip>

namespace knuckle::studies {
namespace {

constexpr double kGap_m = 0.12, kWatched_s = 6, kLast_s = 1.5, kSettled = 0.15;
constexpr int kLasting_ms = 50;

void judge_losses(const std::vector<ContactSample>& samples, std::size_t touch, Impact& impact) {
  int off_ms = 0;
  for (std::size_t i = touch; i < samples.size(); ++i) {
    impact.lift_off_m = std::max(impact.lift_off_m, samples[i].gap_m);
    if (samples[i].push_N <= 0) {
      ++off_ms;
      continue;
    }
    if (off_ms >= kLasting_ms) {
      ++impact.bounces;
      const ContactSample& before = samples[i - 1];
      impact.return_mps =
          std::max(impact.return_mps, (before.gap_m - samples[i].gap_m) / (samples[i].t_s - before.t_s));
    }
    off_ms = 0;
  }
}

void judge_rest(const std::vector<ContactSample>& samples, std::size_t touch, Impact& impact) {
  const double last_N = samples.back().push_N;
  double low = last_N, high = last_N;
  for (std::size_t i = touch; i < samples.size(); ++i) {
    const ContactSample& s = samples[i];
    impact.peak_N = std::max(impact.peak_N, s.push_N);
    if (std::abs(s.push_N - last_N) > kSettled * impact.press_N) impact.settled_s = s.t_s - samples[touch].t_s;
    if (samples.back().t_s - s.t_s > kLast_s) continue;
    low = std::min(low, s.push_N);
    high = std::max(high, s.push_N);
  }
  impact.swing_N = high - low;
}

}  // namespace

Impact run_impact(const MachineDescription& machine, const ContactCell& cell, double speed_mps, double press_N,
                  std::uint64_t seed) {
  ContactTrial trial = trial_of(machine, cell, Valves::kAsOnFile, seed);
  trial.press_N = press_N;
  trial.ram_mps = speed_mps;
  trial.gap_m = kGap_m;
  trial.settle_s = kWatched_s;
  ContactRecord record = run_contact(trial);
  record.samples.resize(std::min(record.samples.size(), record.stepped));
  Impact impact{.cell = cell, .speed_mps = speed_mps, .press_N = press_N};
  const auto touch = std::find_if(record.samples.begin(), record.samples.end(),
                                  [](const ContactSample& sample) { return sample.push_N > 0; });
  if (touch == record.samples.end()) return impact;
  const auto at = static_cast<std::size_t>(touch - record.samples.begin());
  judge_losses(record.samples, at, impact);
  judge_rest(record.samples, at, impact);
  return impact;
}

void print_impacts(const std::vector<Impact>& impacts, std::ostream& out) {
  out << "     pose   wall  m/s asked[N] peak[N] lift-off[mm] bounces return[mm/s] settled[s] swing[N]\n";
  for (const Impact& i : impacts) {
    out << std::setw(9) << i.cell.pose.name << std::setw(7) << std::setprecision(0) << std::scientific
        << i.cell.wall_N_per_m << std::fixed << std::setprecision(2) << std::setw(6) << i.speed_mps << std::setw(8)
        << std::lround(i.press_N) << std::setw(8) << std::lround(i.peak_N) << std::setprecision(1) << std::setw(12)
        << 1e3 * i.lift_off_m << std::setw(8) << i.bounces << std::setw(12) << std::lround(1e3 * i.return_mps)
        << std::setprecision(2) << std::setw(12) << i.settled_s << std::setw(9) << std::lround(i.swing_N) << '\n';
  }
  out << std::defaultfloat;
}

}  // namespace knuckle::studies
