#include "app/operators/intervals.h"

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>

namespace knuckle::operators {

MeanInterval mean_interval(const std::vector<double>& values) {
  MeanInterval interval;
  interval.n = values.size();
  if (values.empty()) return interval;
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  interval.mean = mean;
  if (values.size() < 2) return interval;
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const double t = boost::math::quantile(boost::math::students_t(n - 1), 0.975);
  interval.half_width = t * std::sqrt(squares / (n - 1) / n);
  return interval;
}

}  // namespace knuckle::operators
