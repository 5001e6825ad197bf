#include "app/session/limit_times.h"

#include <algorithm>
#include <array>

namespace knuckle::session {
namespace {

constexpr std::array<const char*, 3> kWalls{"floor", "ceiling", "reach"};

/// The flag is the same for all walls: the nearest one holds.
const char* nearest_wall(const PlanarVector& tip_m, const LimitsDescription& limits) {
  const std::array<double, 3> left_m{tip_m.y() - limits.floor_m, limits.ceiling_m - tip_m.y(),
                                     limits.reach_m - tip_m.x()};
  return kWalls[static_cast<std::size_t>(std::min_element(left_m.begin(), left_m.end()) - left_m.begin())];
}

}  // namespace

std::vector<LimitTime> limit_times(const SessionRecord& record, const LimitsDescription& limits) {
  std::vector<LimitTime> times;
  for (unsigned bit = 0; limit_word(bit) != nullptr; ++bit) {
    if ((1U << bit) != kLimitVirtualWall) {
      times.push_back({limit_word(bit), false, 0});
      continue;
    }
    for (const char* wall : kWalls) times.push_back({wall, true, 0});
  }
  const auto add = [&times](const std::string& limit, double held_s) {
    std::find_if(times.begin(), times.end(), [&](const LimitTime& one) { return one.limit == limit; })->time_s +=
        held_s;
  };
  for (std::size_t i = 1; i < record.samples.size(); ++i) {
    const Sample& sample = record.samples[i];
    const double held_s = sample.t_s - record.samples[i - 1].t_s;
    for (unsigned bit = 0; limit_word(bit) != nullptr; ++bit) {
      if ((sample.machine.limits & (1U << bit)) == 0) continue;
      add((1U << bit) == kLimitVirtualWall ? nearest_wall(sample.tip_m, limits) : limit_word(bit), held_s);
    }
  }
  return times;
}

}  // namespace knuckle::session
