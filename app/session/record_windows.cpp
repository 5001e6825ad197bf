#include "app/session/record_windows.h"

#include <algorithm>

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
      std::fill(at_end.begin() + std::ptrdiff_t(first), at_end.begin() + std::ptrdiff_t(i), true);
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

}  // namespace knuckle::session
