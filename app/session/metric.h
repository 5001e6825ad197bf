// One measured number, and when it was at its worst.
#pragma once

#include <cmath>
#include <optional>

namespace knuckle::session {

/// A number; null where the session had nothing to measure it on (no press, no payload, ...).
struct Metric : std::optional<double> {
  using std::optional<double>::optional;
  /// When it was at its worst; of a mean, when most went into it. Null where there is no such moment.
  std::optional<double> at_s{};
};

/// Keeps the larger value, and when it was; one that is no number is the worst of all.
inline void keep_worst(Metric& worst, double value, double at_s) {
  if (worst && (std::isnan(*worst) || value <= *worst)) return;
  worst = value;
  worst.at_s = at_s;
}
/// Of what is counted, the last one's moment stays.
inline void count_one(Metric& count, double at_s) {
  count = count.value_or(0) + 1;
  count.at_s = at_s;
}

/// Of values added one after the other; null while there is none.
class Mean {
 public:
  void add(double value, double at_s) {
    sum_ += value;
    ++count_;
    keep_worst(largest_, value, at_s);
  }
  [[nodiscard]] Metric value() const {
    Metric mean;
    if (count_ > 0) mean = sum_ / count_;
    mean.at_s = largest_.at_s;
    return mean;
  }
  /// Of values that were added as their squares.
  [[nodiscard]] Metric root() const {
    Metric root = value();
    if (root) *root = std::sqrt(*root);
    return root;
  }

 private:
  double sum_ = 0;
  int count_ = 0;
  Metric largest_;
};

}  // namespace knuckle::session
