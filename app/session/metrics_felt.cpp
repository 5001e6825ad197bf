#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "app/session/metrics.h"
#include "app/session/record_windows.h"
#include "core/quantile.h"

namespace knuckle::session {
namespace {

constexpr double kContactGap_s = 0.05;  // shorter gaps are bounce, which is restitution and not control
constexpr double kHoldJudged_s = 3;     // peak-to-peak: the last seconds of a hold
constexpr double kAllowedShare = 0.1;   // of the true force held: error of the felt force, swing of the true one
constexpr double kAllowedError_N = 0.3, kAllowedSwing_N = 150;  // at least: at the hand; at the machine
constexpr double kTouch_N = 0.05;                               // true force at the hand's scale: first touch
constexpr double kCatchUp_s = 0.1;
constexpr double kStay_s = 0.3;  // longer than an impact
constexpr double kRise = 0.9, kSettled = 0.15;
constexpr double kAfterFault_s = 5;      // whatever a fault does, it has done by then
constexpr double kLeastPlateau_N = 0.1;  // below it there is nothing to rise to

/// True gaps in contact over kContactGap_s after the first touch.
void measure_losses(const SessionRecord& record, const Window& press, Metric& losses) {
  losses = losses ? losses : Metric(0);
  std::size_t i = press.begin;
  while (i < press.end && !in_contact(record.samples[i])) ++i;
  while (i < press.end) {
    while (i < press.end && in_contact(record.samples[i])) ++i;
    if (i == press.end) break;
    const double lost_s = record.samples[i].t_s;
    while (i < press.end && !in_contact(record.samples[i])) ++i;
    const double back_s = record.samples[std::min(i, press.end - 1)].t_s;
    if (back_s - lost_s > kContactGap_s) count_one(losses, lost_s);
  }
}

/// Force over a press, and the level it comes to.
struct Response {
  std::vector<double> force_N;
  double plateau_N = 0;  ///< Median over the second half of the hold, or of the press where it has no hold.

  template <typename Force>
  Response(const SessionRecord& record, const Window& press, Force force) {
    for (std::size_t i = press.begin; i < press.end; ++i) force_N.push_back(force(record.samples[i]));
    Window level = hold_part(record, press);
    if (level.size() == 0) level = press;
    level.begin += level.size() / 2;
    std::vector<double> end;
    for (std::size_t i = level.begin; i < level.end; ++i) end.push_back(force(record.samples[i]));
    plateau_N = median(end);
  }
  /// First row, counted from the press, from which it stays at the share of the plateau for `rows`: an impact is not a
  /// level. force_N.size() if none does.
  [[nodiscard]] std::size_t comes_to_stay(double share, std::size_t rows) const {
    std::size_t run = 0;
    for (std::size_t i = 0; i < force_N.size(); ++i) {
      run = force_N[i] >= share * plateau_N ? run + 1 : 0;
      if (run == rows) return i + 1 - rows;
    }
    return force_N.size();
  }
  /// First row after which the force never again leaves plateau (1 +- band).
  [[nodiscard]] std::size_t stays_within(double band) const {
    std::size_t i = force_N.size();
    while (i > 0 && std::abs(force_N[i - 1] - plateau_N) <= band * plateau_N) --i;
    return i;
  }
};

/// First row at which the felt force is at 90 % of the true one (mean of the last kCatchUp_s: the impact of a machine
/// of 200 kg on a stiff wall is shorter) and stays there for kCatchUp_s; end if none is.
std::size_t catches_up(const Response& felt, const Response& truth, std::size_t touch, std::size_t rows) {
  std::size_t run = 0;
  for (std::size_t i = touch + rows; i < truth.force_N.size(); ++i) {
    const auto last = truth.force_N.begin() + static_cast<std::ptrdiff_t>(i + 1);
    const double mean_N =
        std::accumulate(last - static_cast<std::ptrdiff_t>(rows), last, 0.0) / static_cast<double>(rows);
    run = mean_N > kLeastPlateau_N && felt.force_N[i] >= kRise * mean_N ? run + 1 : 0;
    if (run == rows) return i + 1 - rows;
  }
  return truth.force_N.size();
}

/// Rise: from the first touch until the felt force has caught up with the true one. Settling: from the moment the true
/// force has come to 90 % of its own level for kStay_s.
void measure_response(const SessionRecord& record, const Window& press, Metrics& metrics) {
  const Response truth(record, press, [&](const Sample& s) { return record.force_scale * s.truth.tip_force_N.norm(); });
  const Response felt(record, press, [](const Sample& s) { return s.hand.felt_N.norm(); });
  if (truth.plateau_N < kLeastPlateau_N) return;
  const auto time_s = [&](std::size_t row) { return record.samples[press.begin + row].t_s; };
  const double row_s = record.samples[press.begin + 1].t_s - record.samples[press.begin].t_s;
  const auto rows_in = [row_s](double seconds) { return static_cast<std::size_t>(std::lround(seconds / row_s)); };
  // What is pressed and never felt, or never settles, meets no bound.
  constexpr double kNeverComes_s = std::numeric_limits<double>::infinity();
  const auto touched = std::find_if(truth.force_N.begin(), truth.force_N.end(), [](double f) { return f > kTouch_N; });
  const auto touch = static_cast<std::size_t>(touched - truth.force_N.begin());
  const std::size_t caught_up = catches_up(felt, truth, touch, rows_in(kCatchUp_s));
  const bool is_felt = caught_up < truth.force_N.size();
  keep_worst(metrics.rise_t90_s, is_felt ? time_s(caught_up) - time_s(touch) : kNeverComes_s, time_s(touch));

  const std::size_t start = truth.comes_to_stay(kRise, rows_in(kStay_s));
  if (start == truth.force_N.size()) return;
  const std::size_t settled = felt.stays_within(kSettled);
  const bool settles = is_felt && settled < felt.force_N.size();
  keep_worst(metrics.settle_s, settles ? std::max(0.0, time_s(settled) - time_s(start)) : kNeverComes_s, time_s(start));
}

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] double size() const { return high - low; }
};

void measure_hold(const SessionRecord& record, const Window& hold, Metrics& metrics) {
  if (hold.size() < 2) return;
  Range felt, truth;
  double error = 0, true_sum_N = 0;
  Metric largest;
  const double judged_from_s = record.samples[hold.end - 1].t_s - kHoldJudged_s;
  for (std::size_t i = hold.begin; i < hold.end; ++i) {
    const Sample& s = record.samples[i];
    const double error_N = (record.force_scale * s.truth.tip_force_N - s.hand.felt_N).norm();
    error += error_N;
    keep_worst(largest, error_N, s.t_s);
    true_sum_N += s.truth.tip_force_N.norm();
    if (s.t_s < judged_from_s) continue;
    felt.add(s.hand.felt_N.norm());
    truth.add(s.truth.tip_force_N.norm());
  }
  const auto rows = static_cast<double>(hold.size());
  const double held_N = kAllowedShare * true_sum_N / rows;
  const double error_s = *largest.at_s;
  keep_worst(metrics.hold_peak_to_peak_N, felt.size(), judged_from_s);
  keep_worst(metrics.hold_error_N, error / rows, error_s);
  keep_worst(metrics.hold_error_share, error / rows / std::max(kAllowedError_N, record.force_scale * held_N), error_s);
  keep_worst(metrics.hold_true_swing_share, truth.size() / std::max(kAllowedSwing_N, held_N), judged_from_s);
}

/// The master's own peak between rows, and never less than what the rows themselves show.
double slew_N_per_ms(const SessionRecord& record, std::size_t i) {
  const Sample& s = record.samples[i];
  if (i == 0) return s.felt_slew_N_per_ms;
  const Sample& before = record.samples[i - 1];
  return std::max(s.felt_slew_N_per_ms, (s.hand.felt_N - before.hand.felt_N).norm() / (1e3 * (s.t_s - before.t_s)));
}

/// For kAfterFault_s after each thing that was broken: how far the true force rises above where it was then, and how
/// fast the felt one changes.
void measure_faults(const SessionRecord& record, Metrics& metrics) {
  for (const double broken_s : record.injected_s) {
    const Sample* before = nullptr;
    for (std::size_t i = 0; i < record.samples.size(); ++i) {
      const Sample& s = record.samples[i];
      if (s.t_s <= broken_s) before = &s;
      if (before == nullptr || s.t_s <= broken_s || s.t_s > broken_s + kAfterFault_s) continue;
      keep_worst(metrics.fault_rise_N, s.truth.tip_force_N.norm() - before->truth.tip_force_N.norm(), s.t_s);
      keep_worst(metrics.fault_slew_N_per_ms, slew_N_per_ms(record, i), s.t_s);
    }
  }
}

}  // namespace

void measure_felt(const SessionRecord& record, Metrics& metrics) {
  const auto presses = press_windows(record);
  for (const Window& press : presses) {
    measure_losses(record, press, metrics.contact_losses);
    measure_response(record, press, metrics);
    measure_hold(record, hold_part(record, press), metrics);
  }
  measure_faults(record, metrics);
  const std::vector<bool> empty = empty_free_motion(record);
  Mean squares;
  for (std::size_t i = 0; i < record.samples.size(); ++i) {
    const Sample& s = record.samples[i];
    keep_worst(metrics.max_slew_N_per_ms, slew_N_per_ms(record, i), s.t_s);
    keep_worst(metrics.net_energy_J, s.hand.energy_J - record.samples.front().hand.energy_J, s.t_s);
    if (empty[i]) squares.add(s.hand.felt_N.squaredNorm(), s.t_s);
  }
  metrics.drag_rms_N = squares.root();
}

}  // namespace knuckle::session
