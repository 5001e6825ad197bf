#include "app/console/console_host.h"

#include <utility>

#include "app/programs/program_console.h"
#include "app/session/scenario.h"
#include "app/session/session_setup.h"
#include "core/error.h"
#include "core/loop_table.h"
#include "transport/timed_frame.h"

namespace knuckle::console {
namespace {

constexpr Duration kLongestEnd = 1s;  // a loop that has died keeps no window open

}  // namespace

ConsoleHost::ConsoleHost(const session::SimulateOptions& options, LiveSession::Led led, HidPort* device,
                         std::ostream* candump, LogChoice log)
    : device_(device), candump_(candump), log_(std::move(log)) {
  choose(options, led);
  loop_ = std::make_unique<ConsoleLoop>(make_session(), candump != nullptr);
  log_.take_over(run_);
}

ConsoleHost::ConsoleHost(const StationSetup& setup, Link& link, HidPort* device, LogChoice log)
    : device_(device), log_(std::move(log)) {
  auto station = std::make_unique<OperatorStation>(setup, link, device);
  unix_ns_at_zero_ = static_cast<std::int64_t>(1e9 * programs::unix_time_s()) - clock_.now().time_since_epoch().count();
  if (auto* recorder = log_.make(head_of(setup, unix_ns_at_zero_, log_.choice()), setup.side.machine))
    station->record_to(*recorder);
  loop_ = std::make_unique<ConsoleLoop>(std::move(station));
  log_.take_over(run_);
}

/// With a recording of its own, where there is any.
std::unique_ptr<LiveSession> ConsoleHost::make_session() {
  auto session = std::make_unique<LiveSession>(*session_, led_, device_);
  if (auto* recorder = log_.make(head_of(*session_, chosen_, log_.choice()), session_->machine))
    session->record_to(*recorder);
  return session;
}

ConsoleHost::~ConsoleHost() {
  stop();
}

void ConsoleHost::choose(const session::SimulateOptions& options, LiveSession::Led led) {
  session::SessionSetup loaded = session::load_session(options, false).setup;
  session::refuse_faults(loaded.scenario);
  if (led == LiveSession::Led::kByScenario && follows_recording(loaded.scenario)) {
    throw InputError("--scenario " + options.scenario +
                     ": its operator follows a recorded motion: run it with knuckle simulate, or without --demo");
  }
  const LiveSession trial(loaded, led, nullptr);  // what can be refused is refused now
  chosen_ = options;
  session_ = std::move(loaded);
  led_ = led;
}

void ConsoleHost::skip_to(double simulated_s) {
  for (; to_seconds(skipped_to_) < simulated_s; write_frames()) {
    loop_->step(skipped_to_ += kTick);
    log_.drain();
  }
}

void ConsoleHost::begin() {
  viewed_at_ = now();
  log_.begin();
  thread_ = std::make_unique<RealtimeThread>(RealtimeOptions{.name = "console",
                                                             .period = kTick,
                                                             .fifo_priority = fifo_priority::kMaster,
                                                             .lock_memory = true,
                                                             .health = &health_box_},
                                             clock_, [this](Time now) { loop_->step(now); });
}

void ConsoleHost::end_loop() {
  if (!thread_) return;
  loop_->let_go();
  const Time latest = clock_.now() + kLongestEnd;
  while (!loop_->has_let_go() && clock_.now() < latest) clock_.sleep_until(clock_.now() + kTick);
  thread_->stop();
  thread_.reset();
  write_frames();
}

void ConsoleHost::stop() {
  end_loop();
  log_.close();
}

void ConsoleHost::put(const ConsoleInput& input) {
  loop_->put(input);
  loop_->collect();
  write_frames();
  // One at a time, so that each recording belongs to the session that has begun; another request waits.
  if (offered_ || input.reset_count == std::exchange(resets_, input.reset_count) || !session_) return;
  offered_ = true;
  loop_->offer(make_session());
}

const ConsoleView& ConsoleHost::view() {
  if (!loop_->take(view_)) return view_;
  viewed_at_ = now();
  if (view_.run != std::exchange(run_, view_.run)) {
    offered_ = false;
    log_.take_over(run_);
  }
  return view_;
}

const LoopHealth& ConsoleHost::health() noexcept {
  health_box_.take(health_);
  return health_;
}

void ConsoleHost::write_frames() {
  TimedFrame passed;
  while (loop_->next(passed)) *candump_ << candump_line(passed.at, passed.frame) << '\n';
}

}  // namespace knuckle::console
