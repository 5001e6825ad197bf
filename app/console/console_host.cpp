#include "app/console/console_host.h"

#include <utility>

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
                         std::ostream* candump)
    : device_(device), candump_(candump) {
  choose(options, led);
  loop_ = std::make_unique<ConsoleLoop>(std::make_unique<LiveSession>(*session_, led_, device_), candump != nullptr);
}

ConsoleHost::ConsoleHost(const StationSetup& setup, Link& link, HidPort* device)
    : device_(device), loop_(std::make_unique<ConsoleLoop>(std::make_unique<OperatorStation>(setup, link, device))) {}

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
  session_ = std::move(loaded);
  led_ = led;
}

void ConsoleHost::skip_to(double simulated_s) {
  for (; to_seconds(skipped_to_) < simulated_s; write_frames()) loop_->step(skipped_to_ += kTick);
}

void ConsoleHost::begin() {
  viewed_at_ = now();
  thread_ = std::make_unique<RealtimeThread>(RealtimeOptions{.name = "console",
                                                             .period = kTick,
                                                             .fifo_priority = fifo_priority::kMaster,
                                                             .lock_memory = true,
                                                             .health = &health_box_},
                                             clock_, [this](Time now) { loop_->step(now); });
}

void ConsoleHost::stop() {
  if (!thread_) return;
  loop_->let_go();
  const Time latest = clock_.now() + kLongestEnd;
  while (!loop_->has_let_go() && clock_.now() < latest) clock_.sleep_until(clock_.now() + kTick);
  thread_->stop();
  thread_.reset();
  write_frames();
}

void ConsoleHost::put(const ConsoleInput& input) {
  loop_->put(input);
  loop_->collect();
  write_frames();
  if (input.reset_count == std::exchange(resets_, input.reset_count) || !session_) return;
  loop_->offer(std::make_unique<LiveSession>(*session_, led_, device_));
}

const ConsoleView& ConsoleHost::view() noexcept {
  if (loop_->take(view_)) viewed_at_ = now();
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
