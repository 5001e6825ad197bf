#include "app/session/record_windows.h"

#include <algorithm>
#include <array>

namespace knuckle::session {

std::string_view phase_name(const SessionRecord& record, const Sample& sample) noexcept {
  return sample.phase < record.phases.size() ? std::string_view(record.phases[sample.phase]) : std::string_view();
}

std::string_view phase_at(const SessionRecord& record, double t_s) noexcept {
  const auto after = std::ranges::upper_bound(record.samples, t_s, {}, [](const Sample& sample) { return sample.t_s; });
  return after == record.samples.begin() ? std::string_view() : phase_name(record, *(after - 1));
}

std::vector<bool> free_motion(const SessionRecord& record) {
  std::vector<bool> free(record.samples.size());
  double last_contact_s = -1e9;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const Sample& s = record.samples[i];
    if (in_contact(s)) last_contact_s = s.t_s;
    free[i] = s.machine.mode == Mode::kEngaged && s.t_s - last_contact_s >= kFreeAfterContact_s;
  }
  return free;
}

std::vector<bool> empty_free_motion(const SessionRecord& record) {
  std::vector<bool> empty = free_motion(record);
  double loaded_s = -kFreeAfterContact_s;
  for (std::size_t i = 0; i < empty.size(); ++i) {
    const Sample& s = record.samples[i];
    if (s.truth.payload_kg > 0) loaded_s = s.t_s;
    if (s.t_s - loaded_s < kFreeAfterContact_s) empty[i] = false;
  }
  return empty;
}

std::vector<bool> at_joint_end(const SessionRecord& record) {
  std::vector<bool> at_end(record.samples.size());
  std::size_t first = 0;
  double until_s = -1e9;
  for (std::size_t i = 0; i < at_end.size(); ++i) {
    const Sample& s = record.samples[i];
    const bool beyond = (s.machine.setpoint_rad.array() < record.joint_end_low_rad.array()).any() ||
                        (s.machine.setpoint_rad.array() > record.joint_end_high_rad.array()).any();
    while (first < i && record.samples[first].t_s < s.t_s - record.link_delay_s - kBesideEnd_s) ++first;
    if (beyond) {
      std::fill(at_end.begin() + static_cast<std::ptrdiff_t>(first), at_end.begin() + static_cast<std::ptrdiff_t>(i),
                true);
      first = i;
      until_s = s.t_s + kBesideEnd_s;
    }
    if (s.t_s <= until_s) at_end[i] = true;
  }
  return at_end;
}

bool is_break(const EventRecord& event) noexcept {
  return event.what.find("broke") != std::string::npos;
}

std::vector<Window> press_windows(const SessionRecord& record) {
  const auto pressing = [&](const Sample& s) {
    const std::string_view phase = phase_name(record, s);
    return s.machine.mode == Mode::kEngaged && (phase == "press" || phase == "hold");
  };
  std::vector<Window> windows;
  const auto& rows = record.samples;
  for (std::size_t i = 0; i < rows.size();) {
    if (!pressing(rows[i])) {
      ++i;
      continue;
    }
    Window w{i, i};
    while (w.end < rows.size() && pressing(rows[w.end])) ++w.end;
    i = w.end;
    for (const EventRecord& event : record.events) {
      if (!is_break(event)) continue;
      while (w.size() > 0 && event.t_s >= rows[w.begin].t_s && event.t_s <= rows[w.end - 1].t_s) --w.end;
    }
    if (w.size() > 0) windows.push_back(w);
  }
  return windows;
}

Window hold_part(const SessionRecord& record, const Window& press) noexcept {
  const auto holds = [&](std::size_t i) { return phase_name(record, record.samples[i]) == "hold"; };
  Window hold{press.begin, press.end};
  while (hold.begin < press.end && !holds(hold.begin)) ++hold.begin;
  hold.end = hold.begin;
  while (hold.end < press.end && holds(hold.end)) ++hold.end;
  return hold;
}

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
