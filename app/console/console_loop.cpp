#include "app/console/console_loop.h"

#include <algorithm>
#include <utility>

#include "app/session/loop_views.h"
#include "core/loop_table.h"

namespace knuckle::console {
StationSetup station_setup(const session::SessionSetup& setup) {
  StationSetup station{.side = session::operator_setup(setup),
                       .limb = setup.limb,
                       .hand_rad = setup.scenario.hand_rad,
                       .start_rad = setup.scenario.start_rad,
                       .seed = setup.seed};
  station.side.far_end = master::FarEnd::kTellsItsMachine;  // as a real one
  return station;
}

LiveSession::LiveSession(const session::SessionSetup& setup, Led led, HidPort* device)
    : network_(setup.to_machine, setup.to_operator, setup.seed),
      station_(station_setup(setup), network_.a(), led == Led::kByPerson ? device : nullptr),
      machine_(setup.machine),
      far_(machine_, setup.truth, setup.scenario, setup.seed, network_.b()) {
  far_.side.report_status(machine_, true);
  if (led == Led::kByPerson) return;
  scripted_ = session::operator_of(setup);
}

void LiveSession::record_to(recording::Recorder& recorder) {
  station_.record_to(recorder);
  far_.side.record_to(recorder);
}

void LiveSession::step(const HandInput& held) noexcept {
  now_ += kTick;
  network_.advance(now_);
  if (scripted_) {
    station_.step(now_, scripted_->step(now_, seen_by_operator()));
  } else {
    station_.step(now_, held);
  }
  far_.step(now_, [this] { far_.side.step(now_); });
  count_breaks();
}

sim::OperatorView LiveSession::seen_by_operator() const noexcept {
  return session::person_view(session::view_of(now_, station_.master()), station_.start_rad(), station_.hand(),
                              breaks_);
}

void LiveSession::count_breaks() noexcept {
  const sim::WorldEventRing& ring = plant().events;
  for (; events_read_ < ring.count; ++events_read_)
    if (ring.at(events_read_).kind == sim::WorldEventKind::kPieceBroke) ++breaks_;
}

void LiveSession::show(ConsoleView& view) noexcept {
  station_.show(now_, view);
  view.simulated = true;
  view.led_by_scenario = led_by_scenario();
  view.simulated_s = to_seconds(now_);
  const sim::PlantState& plant = this->plant();
  SimulatedTruth& truth = view.truth;
  truth.pump_Pa = plant.pump_Pa;
  truth.joint_rad = plant.joint_rad;
  truth.events = plant.events;
}

namespace {

constexpr Duration kShowPeriod = 5ms;
constexpr std::int64_t kMostTicks = 5;  // that are made up for at once
constexpr Duration kLately = 2s;        // a fault that comes of a pause is known that soon

}  // namespace

ConsoleLoop::ConsoleLoop(std::unique_ptr<LiveSession> session, bool record_frames)
    : session_(std::move(session)), frames_(record_frames ? std::make_unique<FrameRing>() : nullptr) {
  tap(*session_);
}

ConsoleLoop::ConsoleLoop(std::unique_ptr<OperatorStation> station) : station_(std::move(station)) {}

ConsoleLoop::~ConsoleLoop() {
  delete offered_.load();
  delete retired_.load();
}

void ConsoleLoop::tap(LiveSession& session) noexcept {
  if (!frames_) return;
  const auto keep = [](void* loop, Time at, const CanFrame& frame) {
    auto& self = *static_cast<ConsoleLoop*>(loop);
    self.frames_->push({at + self.recorded_before_, frame});
  };
  session.set_tap({keep, this});
}

void ConsoleLoop::offer(std::unique_ptr<LiveSession> session) noexcept {
  tap(*session);
  delete offered_.exchange(session.release(), std::memory_order_acq_rel);
}

void ConsoleLoop::collect() noexcept {
  delete retired_.exchange(nullptr, std::memory_order_acq_rel);
}

/// The old session goes where the window frees it; while an older one still waits there, the new one waits, too.
void ConsoleLoop::begin_offered() noexcept {
  if (!session_ || retired_.load(std::memory_order_acquire) != nullptr) return;
  LiveSession* const begun = offered_.exchange(nullptr, std::memory_order_acq_rel);
  if (begun == nullptr) return;
  recorded_before_ += session_->now().time_since_epoch();
  retired_.store(session_.release(), std::memory_order_release);
  session_.reset(begun);
  held_.released = false;
  held_.dropped = Dropped::kNewStart;
  watch_.begin_anew();
}

void ConsoleLoop::step(Time now) noexcept {
  now_ = now;
  note_pause(now);
  begin_offered();
  look_at_input(now);
  letting_go_ = let_go_asked_.load(std::memory_order_relaxed);
  if (letting_go_) station().let_go();
  apply(station());
  if (session_) {
    step_session(now);
  } else {
    station_->step(now, hand());
  }
  stepped_at_ = now;
  if (station().master().has_let_go()) has_let_go_.store(true, std::memory_order_release);
  Watched side = watched(station().master());
  side.force_most_N = input_.force_most_N;
  watch_.step(session_time(now), side, session_ ? &session_->plant().events : nullptr);
  blame_own_pause(now);
  if (now >= shown_at_ && now - shown_at_ < kShowPeriod) return;
  shown_at_ = now;
  show();
}

void ConsoleLoop::note_pause(Time now) noexcept {
  if (stepped_at_ == kNever) return;
  const Duration length = now - stepped_at_;
  if (length >= pause_.length || now - pause_.ended > kLately) pause_ = {now, length};
}

/// What grew old while this loop did not run, grew old by it: neither device nor link is to be blamed.
void ConsoleLoop::blame_own_pause(Time now) noexcept {
  if (session_ && !station().has_device()) return;  // its time stands still meanwhile
  const master::MasterLoop& master = station().master();
  const Reason fault = master.machine() && master.machine()->fault ? master.machine()->fault : master.device().reason;
  if (same_cause(fault, judged_fault_)) return;
  judged_fault_ = fault;
  const bool of_age = fault.code == ReasonCode::kDeviceStale || fault.code == ReasonCode::kLinkLost;
  const bool own = of_age && now - pause_.ended <= kLately && 2e3 * to_seconds(pause_.length) >= double(fault.value);
  blamed_ = own ? pause_.length : Duration::zero();
  if (own) watch_.note(session_time(now), ConsoleEventKind::kOwnPause, true, to_seconds(blamed_));
}

/// Stale input counts as released, and so does that of a window without focus, or too small for any screen; after it,
/// enable that was held meanwhile counts as released until it is.
void ConsoleLoop::look_at_input(Time now) noexcept {
  inputs_.take(input_);
  const bool fresh = now - input_.at <= kInputAgeLimit;
  if (fresh != held_.fresh) note_input(ConsoleEventKind::kInput, fresh);
  if (input_.attended != held_.attended) note_input(ConsoleEventKind::kAttended, input_.attended);
  if (input_.too_small != held_.too_small) note_input(ConsoleEventKind::kTooSmall, input_.too_small);
  held_.fresh = fresh;
  held_.attended = input_.attended;
  held_.too_small = input_.too_small;
  held_.ever_fresh |= fresh;
  const bool counts = held_.counts();
  held_.ever_counted |= counts;
  if (held_.ever_counted && !counts && (held_.dropped == Dropped::kNo || !held_.attended))
    held_.dropped = held_.cause();
  held_.released = counts && (held_.released || !input_.hand.enable);
  // Keys that were let go elsewhere, or are still held, read the same here: until the next press nobody knows.
  const bool known = held_.dropped != Dropped::kNoFocus || input_.hand.enable;
  if (!station().has_device() && held_.released && known) held_.dropped = Dropped::kNo;
}

void ConsoleLoop::note_input(ConsoleEventKind kind, bool on) noexcept {
  if (held_.ever_fresh && !led_by_scenario()) watch_.note(session_time(now_), kind, on);
}

HandInput ConsoleLoop::hand() const noexcept {
  if (!held_.counts() || letting_go_) return {};
  HandInput hand = input_.hand;
  hand.enable = hand.enable && held_.released;
  if (!hand.rate_radps.allFinite()) hand.rate_radps.setZero();
  return hand;
}

void ConsoleLoop::apply(OperatorStation& station) noexcept {
  station.set_stop(input_.stop);
  station.set_home(input_.home && held_.counts() && !letting_go_);
  if (station.has_device()) {
    // A short absence may never reach the machine's side: enable that was held all through it does not count after it.
    held_.nobody = !held_.counts() || (held_.nobody && station.master().device().enable);
    station.set_nobody(held_.nobody);
    if (!held_.nobody) held_.dropped = Dropped::kNo;
  }
  // A scenario brings its own settings.
  if (!held_.ever_fresh || led_by_scenario()) return;
  station.set_assist(input_.assist);
  apply_scales(station);
}

/// Told once for every wish.
void ConsoleLoop::apply_scales(OperatorStation& station) noexcept {
  const ScalesAnswer answer = station.set_scales(input_.position_scale, input_.force_scale);
  const bool locked = answer == ScalesAnswer::kLocked;
  if (answer == ScalesAnswer::kTaken || (locked && !scales_locked_))
    watch_.note(session_time(now_), ConsoleEventKind::kScales, !locked);
  scales_locked_ = locked;
}

void ConsoleLoop::step_session(Time now) noexcept {
  const bool paused = input_.paused && !letting_go_;
  if (paused != paused_) watch_.note(session_->now(), ConsoleEventKind::kPaused, paused);
  paused_ = paused;
  if (paused) return;
  const std::int64_t missed = stepped_at_ == kNever ? 1 : (now - stepped_at_) / kTick;
  // A real device feels each step: several at once would change its force by several times the slew limit.
  const std::int64_t most = station().has_device() ? 1 : kMostTicks;
  for (std::int64_t i = 0; i < std::clamp<std::int64_t>(missed, 1, most); ++i) session_->step(hand());
}

void ConsoleLoop::show() noexcept {
  if (session_) {
    session_->show(view_);
  } else {
    station_->show(now_, view_);
  }
  view_.run = watch_.run();
  view_.paused = paused_;
  view_.input = {};
  if (!led_by_scenario())
    view_.input = {.unattended = held_.fresh && !held_.attended,
                   .release_enable = held_.counts() &&
                                     (station().has_device() ? held_.nobody : input_.hand.enable && !held_.released),
                   .dropped = held_.counts() ? held_.dropped : Dropped::kNo};
  view_.input.own_pause_s = to_seconds(blamed_);
  views_.put(view_);
}

}  // namespace knuckle::console
