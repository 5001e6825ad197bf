// The jog's trials of what ends motion when this computer falls silent.
#include <algorithm>
#include <cmath>

#include "slave/jog.h"
#include "slave/sensors.h"
#include "transport/canopen.h"

namespace knuckle::slave {
namespace {

constexpr Duration kGuardPatience = 600ms;  // beyond a guard's own time: status frames, and the spool's way back
constexpr double kOpenShare = 0.5, kBackShare = 0.3;            // of the opening: the spool has followed, or is back
constexpr double kShareOfDeadBand = 0.5, kLeastOpening = 0.03;  // of spool stroke: more than noise
constexpr Duration kStands = 100ms, kStaysBack = 200ms;
constexpr Duration kAskAfter = 90ms;  // of a node that sends no process data: twice in kStaysBack
constexpr double kGuardCreep_m = 2e-3;
constexpr double kMostSilentWays = 4;       // of the way led, for a cylinder that nobody leads any more
constexpr double kMissedSyncs = 3;          // without an input from the module: it is asked
constexpr Duration kAnswerPatience = 50ms;  // then the next is asked

canopen::Object input_object(const BroadcastFrame& frame, const BroadcastField& field) noexcept {
  return {canopen::kAnalogInput.index, static_cast<std::uint8_t>(analog_number(frame.pdo, field.bits))};
}

}  // namespace

Duration Jog::guard_patience(bool in_motion) const noexcept {
  return from_seconds(std::max(machine_.bus.valve_watchdog_s, machine_.bus.controller_timeout_s)) +
         (in_motion ? kSilence : kGuardPatience);
}

/// Inside the dead band no cylinder moves.
void Jog::watch_creep(Time now) noexcept {
  if (guarded_ == 0 || opening_ == 0 || plan_.then_silence) return;
  if (phase_ != Phase::kOpening && phase_ != Phase::kWithheld) return;
  const double crept_m = std::abs(sensors_.length_m[plan_.joint] - from_m_[plan_.joint]);
  if (crept_m <= kGuardCreep_m) return;
  guard_seen_.crept_m = crept_m;
  enter(Phase::kPilotDown, now);
}

void Jog::open_for_guard(Time now) noexcept {
  const bool there =
      client_.demand()[plan_.joint] >= opening_ - 1e-9 && client_.spool()[plan_.joint] >= kOpenShare * opening_;
  stands_since_ = !there ? kNever : stands_since_ == kNever ? now : stands_since_;
  if (there && now - stands_since_ >= kStands) {
    guard_seen_.tried = GuardSeen::Tried::kYes;
    stands_since_ = kNever;
    return enter(Phase::kWithheld, now);
  }
  guard_seen_.tried = GuardSeen::Tried::kDidNotFollow;
  if (now - since_ >= kPilotPatience) enter(Phase::kPilotDown, now);
}

Time Jog::guarded_said_at() const noexcept {
  return opening_ > 0 ? client_.valve_seen_at(plan_.joint) : client_.inputs_seen_at();
}

/// A node that goes pre-operational on a communication error, as CiA 301 has it by default, answers SDO alone.
void Jog::ask_guarded(Time now) noexcept {
  if (tries_outputs()) return ask_inputs(now);
  const bool trying = guarded_ != 0 && (phase_ == Phase::kWithheld || phase_ == Phase::kPilotDown);
  const BusDescription& bus = machine_.bus;
  const double said_every_s = opening_ > 0 ? bus.valve_status_every_nth_sync / bus.sync_Hz : bus.controller_heartbeat_s;
  // Once it has missed one, often enough to know that what it says stays so.
  const bool missed = now - std::max(since_, guarded_said_at()) >= from_seconds(1.5 * said_every_s);
  if (!trying || !(missed || guard_seen_.asked) || now - std::max({since_, guarded_said_at(), asked_at_}) < kAskAfter)
    return;
  client_.ask(guarded_, plan_.joint);
  asked_at_ = now;
  guard_seen_.asked = true;
}

/// Of a module that sends its inputs no more: what the motion is judged by, one question at a time.
void Jog::ask_inputs(Time now) noexcept {
  if (phase_ != Phase::kWithheld || now - inputs_at_ < from_seconds(kMissedSyncs / machine_.bus.sync_Hz)) return;
  if (asked_at_ > answered_at_ && now - asked_at_ < kAnswerPatience) return;
  for (int tries = 0; tries < kJoints; ++tries) {
    asked_joint_ = (asked_joint_ + 1) % kJoints;
    const auto [frame, field] = machine_.bus.broadcast(NodeRole::kEncoder, asked_joint_);
    if (frame == nullptr || frame->module != guarded_) continue;
    if (!bus_.send(canopen::sdo_upload(guarded_, input_object(*frame, *field)))) return;
    asked_at_ = now;
    guard_seen_.asked = true;
    return;
  }
}

void Jog::hear_inputs(const CanFrame& frame, Time now) noexcept {
  if (!tries_outputs() || frame.id != canopen::sdo_response_id(guarded_)) return;
  const auto answer = canopen::parse_sdo_response(frame);
  if (!answer) return;
  answered_at_ = now;
  for (const BroadcastFrame& known : broadcasts_) {
    if (known.module != guarded_) continue;
    for (const BroadcastField& field : known.fields)
      if (const auto raw = answered(*answer, input_object(known, field))) take(field, *raw, now);
  }
}

/// It says that it does not work.
void Jog::note_told(double t_s) noexcept {
  GuardSeen& seen = guard_seen_;
  if (seen.told_s || !client_.says_stopped(guarded_)) return;
  seen.told_s = t_s;
  seen.emergency = client_.emergency_of(guarded_);
  seen.early = t_s < guard_earliest_s_;
}

bool Jog::others_stopped() const noexcept {
  return std::any_of(machine_.bus.nodes.begin(), machine_.bus.nodes.end(), [this](const NodeDescription& node) {
    return node.is_told() && node.id != guarded_ && client_.says_stopped(node.id);
  });
}

void Jog::note_guard(Time now) noexcept {
  if (plan_.then_silence) return note_silence(now);
  GuardSeen& seen = guard_seen_;
  const double t_s = to_seconds(now - since_);
  const bool valve = opening_ > 0;
  note_told(t_s);
  const Time said_at = guarded_said_at();
  seen.silent = now - said_at > kStaysBack;
  bool done = seen.pilot_off_s.has_value();
  if (valve && !client_.pilot_on()) {
    seen.pilot_off_s = t_s;
    seen.stopped_s.reset();
    done = true;
  } else if (valve) {
    const bool back = said_at > since_ && std::abs(client_.spool()[plan_.joint]) <= kBackShare * opening_;
    if (!back || seen.silent) seen.stopped_s.reset();
    if (back && !seen.stopped_s) seen.stopped_s = t_s;
    stands_since_ = !seen.stopped_s || !seen.told_s ? kNever : stands_since_ == kNever ? now : stands_since_;
    done = stands_since_ != kNever && now - stands_since_ >= kStaysBack;
  } else if (!client_.pilot_on()) {
    seen.stopped_s = t_s;
    done = true;
  } else {
    seen.others_stopped = seen.others_stopped || others_stopped();
  }
  const auto before_guard = [&](const std::optional<double>& at_s) { return at_s && *at_s < guard_earliest_s_; };
  seen.early = before_guard(seen.told_s) || before_guard(seen.stopped_s);
  done = done || before_guard(seen.told_s);
  if (done || now - since_ >= guard_patience(false)) enter(Phase::kPilotDown, now);
}

/// The cylinder that was led until no more frames came, or what else the module waits for by whose outputs it is led.
void Jog::note_silence(Time now) noexcept {
  note_sample(now);
  sample_->silent = true;
  if (guarded_ != 0) {
    note_told(to_seconds(now - since_));
    if (!guard_seen_.pilot_off_s && tells_pilot() && !pilot_on()) guard_seen_.pilot_off_s = to_seconds(now - since_);
    for (std::size_t j = 0; j < kJoints; ++j)
      guard_seen_.silent = guard_seen_.silent || now - sensors_.at[kSensorPressures + j] > kStaysBack;
  }
  const double way_m = std::abs(sensors_.length_m[plan_.joint] - from_m_[plan_.joint]);
  const bool over = now - since_ >= from_seconds(guard_seen_.guard_s) + kSilence || guard_seen_.silent;
  if (over || way_m > kMostSilentWays * plan_.travel_m) enter(Phase::kPilotDown, now);
}

void Jog::begin_guard(const NodeDescription& node) noexcept {
  guard_seen_ = {};
  guarded_ = node.id;
  guard_seen_.by_heartbeat = client_.guarded_by(node.id) == CanopenClient::Withheld::kHeartbeat;
  guard_seen_.other_guard = !guard_seen_.by_heartbeat && client_.waits_for_heartbeat(node.id);
}

void Jog::try_guard(const NodeDescription& node, int joint) noexcept {
  if (phase_ != Phase::kRest || !node.is_told() || node.role == NodeRole::kModule) return;
  begin_guard(node);
  plan_ = {};
  opening_ = 0;
  if (node.role == NodeRole::kEnable) return begin(Phase::kWithheld);
  plan_.joint = joint;
  const ValveDescription& valve = machine_.cylinders[static_cast<std::size_t>(plan_.joint)].valve;
  opening_ = kShareOfDeadBand * std::min(valve.dead_band_extend, valve.dead_band_retract);
  stands_since_ = kNever;
  if (opening_ < kLeastOpening) {
    guard_seen_.tried = GuardSeen::Tried::kNoDeadBand;
    return;
  }
  begin(Phase::kOpening);
}

void Jog::try_outputs(const NodeDescription& module, const JogPlan& plan) noexcept {
  if (phase_ != Phase::kRest || plan.joint < 0 || plan.joint >= kJoints) return;
  begin_guard(module);
  plan_ = plan;
  plan_.then_silence = true;
  of_module_.fill(false);
  for (const BroadcastFrame& frame : machine_.bus.broadcasts) {
    for (const BroadcastField& field : frame.fields) {
      const std::size_t place = sensor_place({.signal = field.signal});
      if (frame.module == module.id && place < of_module_.size()) of_module_[place] = true;
    }
  }
  // Chambers without a transmitter are as old as the rest of their cylinder.
  if (const int without = machine_.sensors.without_pressures; without != SensorDescription::kNone)
    for (const int side : {0, 1})
      of_module_[static_cast<std::size_t>(2 * without + side)] =
          of_module_[kSensorPressures + static_cast<std::size_t>(without)];
  begin(Phase::kMoving);
}

}  // namespace knuckle::slave
