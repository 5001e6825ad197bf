// Where the player is: its cursor, and how it moves. Every move ends within the recording.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "app/console/event_book.h"
#include "app/console/player/run.h"
#include "core/time.h"

namespace knuckle::console::player {

inline constexpr std::array kSpeeds{0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0};

class Timeline {
 public:
  /// @param run, @param events outlive this; events in the order of their times.
  Timeline(const Run& run, const std::vector<EventRow>& events) : run_(run), events_(events), cursor_(run.first()) {}

  [[nodiscard]] Time cursor() const noexcept { return cursor_; }
  [[nodiscard]] bool playing() const noexcept { return playing_; }
  [[nodiscard]] double speed() const noexcept { return kSpeeds[speed_]; }
  /// Of the recording, [0, 1].
  [[nodiscard]] double share(Time at) const noexcept;
  [[nodiscard]] Time at_share(double share) const noexcept;

  /// So much time has passed for the person. At the end it stops.
  void pass(double seconds) noexcept;
  /// From the end on it begins anew.
  void toggle() noexcept;
  void faster() noexcept { speed_ = std::min(speed_ + 1, kSpeeds.size() - 1); }
  void slower() noexcept { speed_ -= speed_ > 0 ? 1 : 0; }
  // What follows also pauses.
  void seek(Time to) noexcept;
  void move(Duration by) noexcept { seek(cursor_ + by); }
  /// To the next step of a recorded loop, across gaps too.
  void step(bool forth) noexcept;
  /// To the nearest event that is later, or earlier; stays where there is none.
  void jump(bool forth) noexcept;

 private:
  const Run& run_;
  const std::vector<EventRow>& events_;
  Time cursor_;
  bool playing_ = false;
  std::size_t speed_ = 3;
};

}  // namespace knuckle::console::player
