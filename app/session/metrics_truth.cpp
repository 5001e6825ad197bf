#include <algorithm>
#include <cmath>
#include <deque>

#include "app/session/metrics.h"
#include "app/session/record_windows.h"
#include "estimation/observer.h"

namespace knuckle::session {
namespace {

constexpr double kWorst_s = 0.5;     // of a mean error
constexpr double kNoticed_N = 0.35;  // at the hand: a person notices
constexpr double kLasting_s = 0.3;   // shorter contacts need not be felt
constexpr double kUnfelt_N = 2;      // by so much the truth may not pass what is felt for kLasting_s
constexpr double kShowable_Hz = 20;  // fastest swing of 3 N at the hand that the device's 0.4 N/ms follow
constexpr double kSwing_s = 0.25;    // a hand does not change a force by much within this time; a limit cycle does
constexpr double kTouching_s = 0.5;  // after the first touch: an impact is not a swing
constexpr double kShortGap_s = 0.05, kLongGap_s = 0.5;  // shorter: restitution; longer: the hand has gone away

struct Row {
  double t_s = 0;
  bool engaged = false;
  // At the hand's scale.
  PlanarVector touch_N = PlanarVector::Zero(), weight_N = PlanarVector::Zero(), felt_N = PlanarVector::Zero();
  double contact_N = 0;  ///< On the machine.
  bool at_end = false;   ///< The wall at a joint's end is felt as well.
  [[nodiscard]] PlanarVector true_N() const { return touch_N + weight_N; }
};

/// Touch and weight as the hand could feel them first: one link delay later.
std::vector<Row> rows_of(const SessionRecord& record) {
  std::vector<Row> rows;
  rows.reserve(record.samples.size());
  std::size_t past = 0;
  const std::vector<bool> at_end = at_joint_end(record);
  for (const Sample& s : record.samples) {
    while (past + 1 < record.samples.size() && record.samples[past + 1].t_s <= s.t_s - record.link_delay_s) ++past;
    const Sample& then = record.samples[past];
    rows.push_back({s.t_s, s.machine.mode == Mode::kEngaged && then.machine.mode == Mode::kEngaged,
                    record.force_scale * then.truth.tip_force_N, record.force_scale * then.truth.weight_N,
                    s.hand.felt_N, s.truth.tip_force_N.norm(), at_end[rows.size()]});
  }
  return rows;
}

/// A sum over the last so many seconds of rows that follow one another.
class Sliding {
 public:
  explicit Sliding(double length_s) : length_s_(length_s) {}
  void clear() { values_.clear(); }
  void add(double t_s, double value) {
    values_.push_back({t_s, value});
    while (t_s - values_.front().t_s > length_s_ + 1e-9) values_.pop_front();
  }
  /// Whether it spans its whole length, but for a row.
  [[nodiscard]] bool full() const { return values_.size() > 2 && span_s() + row_s() > length_s_ - 1e-9; }
  [[nodiscard]] double mean() const {
    double sum = 0;
    for (const Value& v : values_) sum += v.value;
    return sum / static_cast<double>(values_.size());
  }
  [[nodiscard]] double swing() const {
    const auto by_value = [](const Value& a, const Value& b) { return a.value < b.value; };
    const auto [low, high] = std::minmax_element(values_.begin(), values_.end(), by_value);
    return high->value - low->value;
  }

 private:
  struct Value {
    double t_s, value;
  };
  [[nodiscard]] double span_s() const { return values_.back().t_s - values_.front().t_s; }
  [[nodiscard]] double row_s() const { return span_s() / static_cast<double>(values_.size() - 1); }
  double length_s_;
  std::deque<Value> values_;
};

void measure_error(const std::vector<Row>& rows, Metrics& metrics) {
  double error2 = 0, true2 = 0;
  std::size_t count = 0;
  Sliding recent(kWorst_s);
  for (const Row& row : rows) {
    if (!row.engaged || row.at_end) {
      recent.clear();
      continue;
    }
    const PlanarVector error_N = row.felt_N - row.true_N();
    error2 += error_N.squaredNorm();
    true2 += row.true_N().squaredNorm();
    ++count;
    recent.add(row.t_s, error_N.norm());
    if (recent.full()) keep_worst(metrics.felt_error_worst_N, recent.mean(), row.t_s - kWorst_s / 2);
  }
  if (count == 0) return;
  metrics.felt_error_rms_N = std::sqrt(error2 / static_cast<double>(count));
  const double true_rms_N = std::sqrt(true2 / static_cast<double>(count));
  if (true_rms_N > 0) metrics.felt_error_rel = *metrics.felt_error_rms_N / true_rms_N;
  metrics.felt_error_rms_N.at_s = metrics.felt_error_rel.at_s = metrics.felt_error_worst_N.at_s;
}

/// The true force of each row as the device shows it at best: up to its largest force, no faster than kShowable_Hz.
std::vector<PlanarVector> showable_N(const std::vector<Row>& rows, double largest_N) {
  const auto limited_N = [largest_N](const PlanarVector& force_N) -> PlanarVector {
    return force_N * (largest_N / std::max(force_N.norm(), largest_N));
  };
  const double row_s = (rows.back().t_s - rows.front().t_s) / static_cast<double>(rows.size() - 1);
  estimation::FohFilter<PlanarVector> bandwidth(kShowable_Hz, row_s);
  bandwidth.reset(limited_N(rows.front().true_N()));
  std::vector<PlanarVector> shown_N;
  shown_N.reserve(rows.size());
  for (const Row& row : rows) shown_N.push_back(bandwidth.step(limited_N(row.true_N())));
  return shown_N;
}

/// Whether a force is above what is felt of it, along it, by more than kUnfelt_N.
bool above_felt(const PlanarVector& force_N, const PlanarVector& felt_N) {
  const double size_N = force_N.norm();
  return size_N > kUnfelt_N && size_N - felt_N.dot(force_N) / size_N > kUnfelt_N;
}

/// Time in which the truth is above what is felt for at least kLasting_s: the machine presses, and nobody is told. Of
/// it, the time in which the device could have told. Nothing where there was no force to be felt.
void measure_unfelt(const std::vector<Row>& rows, double largest_N, Metrics& metrics) {
  const auto to_be_felt = [](const Row& row) { return row.engaged && row.true_N().norm() > kNoticed_N; };
  if (rows.size() < 2 || std::ranges::none_of(rows, to_be_felt)) return;
  const std::vector<PlanarVector> shown_N = showable_N(rows, largest_N);
  double since_s = -1, shown_since_s = 0, unfelt_s = 0, unfelt_showable_s = 0;
  Metric longest_s;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool last = i + 1 == rows.size();
    const bool unfelt = rows[i].engaged && above_felt(rows[i].true_N(), rows[i].felt_N);
    if (unfelt && since_s < 0) {
      since_s = rows[i].t_s;
      shown_since_s = 0;
    }
    if (unfelt && !last && above_felt(shown_N[i], rows[i].felt_N)) shown_since_s += rows[i + 1].t_s - rows[i].t_s;
    if (since_s >= 0 && (!unfelt || last)) {
      const double length_s = rows[i].t_s - since_s;
      if (length_s >= kLasting_s) {
        unfelt_s += length_s;
        unfelt_showable_s += shown_since_s;
        keep_worst(longest_s, length_s, since_s);
      }
      since_s = -1;
    }
  }
  metrics.unfelt_s = unfelt_s;
  metrics.unfelt_showable_s = unfelt_showable_s;
  metrics.unfelt_s.at_s = metrics.unfelt_showable_s.at_s = longest_s.at_s;
}

/// Slowest onset: from where a force (touch, or weight) passes kNoticed_N to where what is felt has changed by as much
/// along it; of every force that lasts. Gaps up to kLongGap_s are of the same one: a strike bounces.
void measure_onset(const std::vector<Row>& rows, PlanarVector Row::*force, Metrics& metrics) {
  const auto on = [&](const Row& row) { return row.engaged && (row.*force).norm() > kNoticed_N; };
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (!on(rows[i]) || !rows[i - 1].engaged) continue;
    const std::size_t begin = i;
    std::size_t last = i;
    std::optional<double> felt_s;
    for (; i < rows.size() && rows[i].engaged && rows[i].t_s - rows[last].t_s <= kLongGap_s; ++i) {
      if (!on(rows[i])) continue;
      last = i;
      const PlanarVector along = (rows[i].*force).normalized();
      if (!felt_s && along.dot(rows[i].felt_N - rows[begin - 1].felt_N) > kNoticed_N) felt_s = rows[i].t_s;
    }
    if (rows[last].t_s - rows[begin].t_s >= kLasting_s)
      keep_worst(metrics.felt_onset_ms, 1e3 * (felt_s.value_or(rows[last].t_s) - rows[begin].t_s), rows[begin].t_s);
    --i;  // the row that ended it may begin another one
  }
}

/// Swing of the true force within kSwing_s once a contact has lasted, and gaps too short for a hand that goes away. A
/// swing counts where there is contact kLongGap_s later: a hand that lets go makes none.
void measure_contact(const std::vector<Row>& rows, Metrics& metrics) {
  struct Swing {
    double t_s, size_N;
  };
  std::deque<Swing> pending;
  Sliding recent(kSwing_s);
  double since_s = -1, lost_s = -1;
  for (const Row& row : rows) {
    if (!row.engaged) {
      since_s = lost_s = -1;
      recent.clear();
      pending.clear();
      continue;
    }
    if (row.contact_N > kContactForce_N) {
      if (lost_s >= 0) {
        const double gap_s = row.t_s - lost_s;
        if (gap_s > kShortGap_s && gap_s < kLongGap_s) count_one(metrics.contact_bounces, lost_s);
        if (gap_s >= kLongGap_s) {
          since_s = -1;
          pending.clear();
        }
      }
      lost_s = -1;
      if (since_s < 0) since_s = row.t_s;
      if (!metrics.contact_bounces) metrics.contact_bounces = 0;
      for (; !pending.empty() && pending.front().t_s <= row.t_s - kLongGap_s; pending.pop_front())
        keep_worst(metrics.contact_swing_N, pending.front().size_N, pending.front().t_s);
    } else if (since_s >= 0 && lost_s < 0) {
      lost_s = row.t_s;
    }
    if (since_s < 0 || row.t_s - since_s < kTouching_s || (lost_s >= 0 && row.t_s - lost_s >= kShortGap_s)) {
      recent.clear();
      continue;
    }
    recent.add(row.t_s, row.contact_N);
    if (recent.full()) pending.push_back({row.t_s, recent.swing()});
  }
}

/// Of each press that asks for a certain force: its peak, held or not, over that.
void measure_presses(const SessionRecord& record, Metrics& metrics) {
  double asked_N = 0;
  for (const Sample& s : record.samples) {
    if (s.phase < record.asked_N.size()) asked_N = record.asked_N[s.phase];  // else it holds
    if (asked_N > 0 && s.machine.mode == Mode::kEngaged)
      keep_worst(metrics.peak_over_asked, s.truth.tip_force_N.norm() / asked_N, s.t_s);
  }
}

}  // namespace

void measure_truth(const SessionRecord& record, Metrics& metrics) {
  const std::vector<Row> rows = rows_of(record);
  measure_error(rows, metrics);
  measure_unfelt(rows, record.device_limit_N, metrics);
  measure_onset(rows, &Row::touch_N, metrics);
  measure_onset(rows, &Row::weight_N, metrics);
  measure_contact(rows, metrics);
  measure_presses(record, metrics);
  const std::vector<bool> empty = empty_free_motion(record);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (empty[i] && !rows[i].at_end) keep_worst(metrics.free_felt_peak_N, rows[i].felt_N.norm(), rows[i].t_s);
  }
}

}  // namespace knuckle::session
