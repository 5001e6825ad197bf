// One run of a session as the player shows it: what was known at any time of it, found at once.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "app/console/console_view.h"
#include "app/console/event_book.h"
#include "app/console/player/run_data.h"
#include "core/time.h"

namespace knuckle::console::player {

class Run {
 public:
  Run() = default;
  explicit Run(RunData data);

  [[nodiscard]] const RunData& data() const noexcept { return data_; }
  [[nodiscard]] bool empty() const noexcept { return data_.hand.empty() && data_.machine.empty(); }
  /// Of its steps.
  [[nodiscard]] Time first() const noexcept { return first_; }
  [[nodiscard]] Time last() const noexcept { return last_; }

  /// When the operator's side first heard the machine; first() where it is not recorded, or never did.
  [[nodiscard]] Time first_heard() const noexcept;

  /// What the console's screens showed, or would have shown, at this time: what was newest then, without what the link
  /// did of late. What is not recorded is NaN: in a gap all but the machine's last pose.
  [[nodiscard]] ConsoleView view(Time at) const;
  /// Puts in what the link did in the ten seconds before, as far as that is recorded without a hole.
  void show_link(Time at, LinkSide& link) const;
  /// From when on all messages up to this time are recorded: the beginning, or the end of the last hole. nullopt: none
  /// has come since.
  [[nodiscard]] std::optional<Time> counted_from(Time at) const noexcept;
  /// The machine's step whose message is the newest at this time. Where up to 100 ms of steps are missing, the last one
  /// before them. nullptr: none, or not recorded.
  [[nodiscard]] const MachineStep* machine_at(Time at) const noexcept;

  /// The loops' steps next to this time; nullopt: there is none.
  [[nodiscard]] std::optional<Time> step_after(Time at) const noexcept;
  [[nodiscard]] std::optional<Time> step_before(Time at) const noexcept;

  /// Holes of more than 100 ms in the steps of either side. A gap ends with the first message behind it whose step is
  /// recorded, or when the link has been silent for 250 ms.
  [[nodiscard]] const std::vector<Gap>& gaps() const noexcept { return gaps_; }
  /// Within the recording, and in none of its gaps.
  [[nodiscard]] bool recorded(Time at) const noexcept;
  /// The machine's modes, each until the next.
  struct ModeSpan {
    Time from{};
    Mode mode = Mode::kOff;
  };
  [[nodiscard]] const std::vector<ModeSpan>& modes() const noexcept { return modes_; }

 private:
  [[nodiscard]] const Gap* gap_at(Time at) const noexcept;
  [[nodiscard]] Time known_again(Time hole_end) const noexcept;
  [[nodiscard]] bool gap_between(Time earlier, Time later) const noexcept;
  void find_gaps();
  void find_modes();

  RunData data_;
  Time first_{}, last_{};
  std::vector<Gap> gaps_;
  std::vector<ModeSpan> modes_;
};

// Where the player is: its cursor, and how it moves. Every move ends within the recording.

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
