// Everything behind the console's window, in the window's hands: clock, real-time thread, loop, and the log of the
// simulated bus, and recordings. All calls belong to the window's thread; none waits for the loop but end_loop() and
// stop().
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <ostream>

#include "app/console/console_log.h"
#include "app/console/console_loop.h"
#include "app/console/console_view.h"
#include "app/console/event_book.h"
#include "app/console/hand_input.h"
#include "app/session/options.h"
#include "app/session/session.h"
#include "core/loop_health.h"
#include "core/mailbox.h"
#include "core/realtime_thread.h"
#include "core/time.h"
#include "transport/hid_port.h"
#include "transport/link.h"

namespace knuckle::console {

class ConsoleHost {
 public:
  /// A simulated session. @param device a haptic device that leads it, nullptr: a simulated hand.
  /// @param candump where every frame of its bus goes, a stream that never waits for its reader; nullptr: nowhere. Both
  /// outlive this. @param log what is recorded; nothing unless it says so.
  /// @throws InputError as choose() does, and where the folder named for recordings cannot be written.
  ConsoleHost(const session::SimulateOptions& options, LiveSession::Led led, HidPort* device, std::ostream* candump,
              LogChoice log = {});
  /// The operator's side of a machine that is elsewhere. @param link, @param device outlive this; nullptr as above.
  ConsoleHost(const StationSetup& setup, Link& link, HidPort* device, LogChoice log = {});
  /// As stop().
  ~ConsoleHost();
  ConsoleHost(const ConsoleHost&) = delete;
  ConsoleHost& operator=(const ConsoleHost&) = delete;

  /// Before begin(), or instead of it: takes a simulated session on to this time, as fast as it goes. With a session
  /// led by its scenario the same time always shows the same picture. May be called again, for a later time.
  void skip_to(double simulated_s);
  /// From now on the loop runs, in a thread of its own.
  void begin();
  /// Lets go of machine and device in order, and ends the thread: what happened until then can still be recorded. May
  /// be called again.
  void end_loop();
  /// The same, and ends the recording.
  void stop();

  /// In every frame: what is requested; a session is restarted where reset_count has grown, and begins a recording of
  /// its own. Also writes the log and frees what is no longer used.
  void put(const ConsoleInput& input);
  /// What the next restarted session is made of. Nothing changes before.
  /// @throws InputError as load_session() does, and for what no console can play: scheduled faults, and a scenario's
  /// operator who follows a recording. What was chosen before stays.
  void choose(const session::SimulateOptions& options, LiveSession::Led led);

  /// The newest. After next(): what happened before a session was restarted goes into the recording of that time.
  const ConsoleView& view();
  /// Since the loop last gave one, as far as view() has looked: whether it runs at all.
  [[nodiscard]] double view_age_s() const noexcept { return to_seconds(now() - viewed_at_); }
  bool next(ConsoleEvent& event) noexcept { return loop_->next(event); }
  [[nodiscard]] std::uint64_t events_lost() const noexcept { return loop_->events_lost(); }
  [[nodiscard]] std::uint64_t frames_lost() const noexcept { return loop_->frames_lost(); }
  /// For the light, notes for the terminal, and what is to go into the recording, too.
  [[nodiscard]] ConsoleLog& log() noexcept { return log_; }
  [[nodiscard]] const ConsoleLog& log() const noexcept { return log_; }
  /// Of the loop's thread; updated a few times a second.
  const LoopHealth& health() noexcept;
  /// Set-up of the simulated session chosen last; nothing where there is none.
  [[nodiscard]] const std::optional<session::SessionSetup>& session() const noexcept { return session_; }
  [[nodiscard]] Time now() const noexcept { return clock_.now(); }
  /// Of session time 0, by the computer's clock; 0 for a simulated session.
  [[nodiscard]] std::int64_t unix_ns_at_zero() const noexcept { return unix_ns_at_zero_; }

 private:
  [[nodiscard]] std::unique_ptr<LiveSession> make_session();
  void write_frames();

  RealtimeClock clock_;
  HidPort* device_;
  std::ostream* candump_ = nullptr;
  session::SimulateOptions chosen_;
  std::optional<session::SessionSetup> session_;
  LiveSession::Led led_ = LiveSession::Led::kByPerson;
  std::int64_t unix_ns_at_zero_ = 0;
  ConsoleLog log_;  // outlives the loops that it records
  std::unique_ptr<ConsoleLoop> loop_;
  std::uint32_t resets_ = 0, run_ = 1;
  bool offered_ = false;  // a session that has not begun yet
  Time skipped_to_{};
  ConsoleView view_;
  Time viewed_at_{};
  Mailbox<LoopHealth> health_box_;
  LoopHealth health_;
  std::unique_ptr<RealtimeThread> thread_;
};

}  // namespace knuckle::console
