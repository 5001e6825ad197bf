// Session time. Nothing above the drivers reads a clock: a Time is passed into every step, so that a session
// on virtual time runs faster than real time and repeats bit for bit.
#pragma once

#include <chrono>
#include <cstdint>

namespace knuckle {

using namespace std::chrono_literals;

using Duration = std::chrono::nanoseconds;

/// Monotonic time of one process. It has no now(): only the loops' drivers know what time it is.
struct SessionClock {
  using duration = Duration;
  using rep = Duration::rep;
  using period = Duration::period;
  using time_point = std::chrono::time_point<SessionClock, Duration>;
  static constexpr bool is_steady = true;
};
using Time = SessionClock::time_point;

/// "It has not happened": older than every age limit, and safe to subtract from any session time.
inline constexpr Time kNever{std::chrono::hours(-24 * 365)};

[[nodiscard]] constexpr double to_seconds(Duration d) noexcept {
  return std::chrono::duration<double>(d).count();
}
[[nodiscard]] constexpr double to_seconds(Time t) noexcept {
  return to_seconds(t.time_since_epoch());
}
/// As reasons say it.
[[nodiscard]] constexpr float to_ms(Duration d) noexcept {
  return static_cast<float>(to_seconds(d) * 1e3);
}
inline constexpr double kLongestAge_s = 1e6;
/// Age of what happened at `at`, at most kLongestAge_s; also of what never did.
[[nodiscard]] constexpr double age_s(Time at, Time now) noexcept {
  return at == kNever || to_seconds(now - at) > kLongestAge_s ? kLongestAge_s : to_seconds(now - at);
}
[[nodiscard]] constexpr Duration from_seconds(double seconds) noexcept {
  return Duration(static_cast<std::int64_t>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5)));
}

}  // namespace knuckle
