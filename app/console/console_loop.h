// What the console's one real-time thread steps: the simulated session or the operator's station, by what the window
// asks for. The window meets it in mailboxes and rings only, so it may stall as long as it likes.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "app/console/console_view.h"
#include "app/console/event_book.h"
#include "app/console/hand_input.h"
#include "app/console/operator_station.h"
#include "app/session/frame_log.h"
#include "app/session/session.h"
#include "app/session/session_sides.h"
#include "core/mailbox.h"
#include "core/ring.h"
#include "core/time.h"
#include "machine/description.h"
#include "recording/recorder.h"
#include "sim/operator.h"
#include "transport/hid_port.h"
#include "transport/impaired_link.h"
#include "transport/virtual_can.h"

namespace knuckle::console {

/// The operator's side of a simulated session.
[[nodiscard]] StationSetup station_setup(const session::SessionSetup& setup);

// A simulated session that a person leads: the loops and the plant of app/session/session.h in lock-step on virtual
// time, for as long as anybody likes. A scenario gives the world and the start; what it breaks on a schedule stays
// whole.

class LiveSession {
 public:
  enum class Led : std::uint8_t {
    kByPerson,    ///< keyboard, mouse, gamepad, or the haptic device
    kByScenario,  ///< by the operator of the scenario: the session repeats bit for bit
  };

  /// @param device a haptic device, which outlives this; nullptr: a simulated one.
  /// @throws InputError where the setup does not fit together. Allocates all that steps need.
  LiveSession(const session::SessionSetup& setup, Led led, HidPort* device);
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  /// Told of every frame on the bus, in step().
  void set_tap(CanTap tap) noexcept { far_.simulated.set_tap(tap); }
  /// Before the first step: all that both loops read, do and know goes there. @param recorder outlives the last step.
  void record_to(recording::Recorder& recorder);
  /// One millisecond. Allocates nothing.
  void step(const HandInput& held) noexcept;

  [[nodiscard]] Time now() const noexcept { return now_; }
  [[nodiscard]] bool led_by_scenario() const noexcept { return scripted_.has_value(); }
  [[nodiscard]] OperatorStation& station() noexcept { return station_; }
  [[nodiscard]] const sim::PlantState& plant() const noexcept { return far_.simulated.plant(); }
  /// Puts in all but what the loop around this knows.
  void show(ConsoleView& view) noexcept;

 private:
  [[nodiscard]] sim::OperatorView seen_by_operator() const noexcept;
  void count_breaks() noexcept;

  Time now_{};
  ImpairedLink network_;
  OperatorStation station_;
  MachineDescription machine_;
  session::SimulatedMachineSide far_;
  std::optional<sim::Operator> scripted_;
  std::uint64_t events_read_ = 0;
  int breaks_ = 0;
};

class ConsoleLoop {
 public:
  using FrameRing = Ring<TimedFrame, 1 << 16>;  ///< About 20 s of a machine's bus.

  explicit ConsoleLoop(std::unique_ptr<LiveSession> session, bool record_frames = false);
  explicit ConsoleLoop(std::unique_ptr<OperatorStation> station);
  ~ConsoleLoop();
  ConsoleLoop(const ConsoleLoop&) = delete;
  ConsoleLoop& operator=(const ConsoleLoop&) = delete;

  // For the loop's thread.
  /// Every millisecond. A simulated session makes up for a few periods that were missed; time that is lost beyond that
  /// is lost for the session, too. Allocates nothing.
  void step(Time now) noexcept;

  // For the window's thread; none of it waits.
  void put(const ConsoleInput& input) noexcept { inputs_.put(input); }
  /// False where there is nothing new.
  bool take(ConsoleView& view) noexcept { return views_.take(view); }
  bool next(ConsoleEvent& event) noexcept { return events_.pop(event); }
  [[nodiscard]] std::uint64_t events_lost() const noexcept { return events_.dropped(); }
  /// Frames of the simulated bus, where they are recorded, in time that continues when a session is restarted.
  bool next(TimedFrame& frame) noexcept { return frames_ && frames_->pop(frame); }
  [[nodiscard]] std::uint64_t frames_lost() const noexcept { return frames_ ? frames_->dropped() : 0; }
  /// Restarts a simulated session with this one, which replaces one that was offered and is not yet begun.
  void offer(std::unique_ptr<LiveSession> session) noexcept;
  /// Frees the session that was replaced.
  void collect() noexcept;
  /// For the end: inputs count as released from now on, and a haptic device's torque is off.
  void let_go() noexcept { let_go_asked_.store(true, std::memory_order_relaxed); }
  /// It was sent for long enough.
  [[nodiscard]] bool has_let_go() const noexcept { return has_let_go_.load(std::memory_order_acquire); }

 private:
  /// What is held, as far as it counts.
  struct Held {
    bool nobody = true;  ///< With a haptic device.
    bool ever_fresh = false, fresh = false, attended = false, too_small = false, released = false;
    bool ever_counted = false;
    Dropped dropped = Dropped::kNo;
    [[nodiscard]] bool counts() const noexcept { return fresh && attended && !too_small; }
    /// Why it does not.
    [[nodiscard]] Dropped cause() const noexcept {
      return !attended ? Dropped::kNoFocus : too_small ? Dropped::kTooSmall : Dropped::kStalled;
    }
  };
  /// Time in which the loop did not run.
  struct Pause {
    Time ended = kNever;
    Duration length{};
  };
  void tap(LiveSession& session) noexcept;
  void begin_offered() noexcept;
  void look_at_input(Time now) noexcept;
  void note_pause(Time now) noexcept;
  void blame_own_pause(Time now) noexcept;
  void note_input(ConsoleEventKind kind, bool on) noexcept;
  [[nodiscard]] HandInput hand() const noexcept;
  void apply(OperatorStation& station) noexcept;
  void apply_scales(OperatorStation& station) noexcept;
  void step_session(Time now) noexcept;
  void show() noexcept;
  [[nodiscard]] OperatorStation& station() noexcept { return session_ ? session_->station() : *station_; }
  [[nodiscard]] Time session_time(Time now) const noexcept { return session_ ? session_->now() : now; }
  [[nodiscard]] bool led_by_scenario() const noexcept { return session_ && session_->led_by_scenario(); }

  std::unique_ptr<LiveSession> session_;  // one of the two
  std::unique_ptr<OperatorStation> station_;
  std::atomic<LiveSession*> offered_{nullptr}, retired_{nullptr};
  std::atomic<bool> let_go_asked_{false}, has_let_go_{false};
  Mailbox<ConsoleInput> inputs_;
  Mailbox<ConsoleView> views_;
  EventRing events_;
  std::unique_ptr<FrameRing> frames_;

  // The loop's thread.
  ConsoleInput input_;
  Held held_;
  Pause pause_;          // the longest of late
  Reason judged_fault_;  // whether it comes of a pause
  Duration blamed_{};    // the pause that it comes of; zero: none
  EventWatch watch_{events_};
  ConsoleView view_;
  Time now_{}, stepped_at_ = kNever, shown_at_ = kNever;
  Duration recorded_before_{};  // by sessions that were replaced
  bool scales_locked_ = false, paused_ = false, letting_go_ = false;
};

}  // namespace knuckle::console
