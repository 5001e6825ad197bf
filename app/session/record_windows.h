// Stretches of a session that a metric is taken over: free motion, the operator meaning to touch, and the time for
// which each limit held the machine back.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "app/session/session_record.h"
#include "machine/description.h"

namespace knuckle::session {

/// Rows [begin, end).
struct Window {
  std::size_t begin = 0, end = 0;
  [[nodiscard]] std::size_t size() const noexcept { return end - begin; }
};

inline constexpr double kContactForce_N = 1;      ///< True force on the tip above this is contact.
inline constexpr double kFreeAfterContact_s = 1;  ///< Free motion begins this long after the last contact.
inline constexpr double kBesideEnd_s = 0.1;       ///< Jitter and filters, either side of a wall at a joint's end.

[[nodiscard]] inline bool in_contact(const Sample& s) noexcept {
  return s.truth.tip_force_N.norm() > kContactForce_N;
}

/// Name of a row's phase; empty where the record has none.
[[nodiscard]] std::string_view phase_name(const SessionRecord& record, const Sample& sample) noexcept;

/// Of the operator at a time; empty before the first row.
[[nodiscard]] std::string_view phase_at(const SessionRecord& record, double t_s) noexcept;

/// Per row: engaged, and no contact now or within the last kFreeAfterContact_s.
[[nodiscard]] std::vector<bool> free_motion(const SessionRecord& record);
/// Of these the rows with no load either, now or within that time: nothing is to be felt.
[[nodiscard]] std::vector<bool> empty_free_motion(const SessionRecord& record);

/// Per row: the hand is, or within kBesideEnd_s was or will be, where it feels the wall at a joint's end. Known from
/// the set-points that the machine has received, one link delay later.
[[nodiscard]] std::vector<bool> at_joint_end(const SessionRecord& record);

/// Runs of the phases "press" and "hold" while engaged. One that a "broke" event falls into ends there.
[[nodiscard]] std::vector<Window> press_windows(const SessionRecord& record);

/// The part of a press window in phase "hold"; empty where there is none.
[[nodiscard]] Window hold_part(const SessionRecord& record, const Window& press) noexcept;

/// Whether an event is a piece that broke.
[[nodiscard]] bool is_break(const EventRecord& event) noexcept;

struct LimitTime {
  std::string limit;  ///< As limit_word() says; a virtual wall by its own name: "floor", "ceiling", "reach".
  bool wall = false;
  double time_s = 0;
};

/// Every limit, also those that were never met, in the order of LimitFlag. Several may hold at one time.
[[nodiscard]] std::vector<LimitTime> limit_times(const SessionRecord& record, const LimitsDescription& limits);

}  // namespace knuckle::session
