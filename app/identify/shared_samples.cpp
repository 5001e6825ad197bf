#include "app/identify/shared_samples.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <vector>

#include "app/recordings/recording_reader.h"

namespace knuckle::identify {
namespace {

using Values = std::array<double, recordings::kSignalChannels>;

/// Sorted, each once.
std::vector<Values> values_of(const estimation::Recording& recording) {
  std::vector<Values> values;
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    if (recording.usable[i] == 0) continue;
    values.emplace_back();
    for (std::size_t c = 0; c < recordings::kSignalChannels; ++c)
      values.back()[c] = recordings::signal(recording.samples[i], c);
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

}  // namespace

double shared_samples(const estimation::Recording& a, const estimation::Recording& b) {
  const std::vector<Values> of_a = values_of(a), of_b = values_of(b);
  std::vector<Values> both;
  std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::back_inserter(both));
  return of_b.empty() ? 0 : static_cast<double>(both.size()) / static_cast<double>(of_b.size());
}

}  // namespace knuckle::identify
