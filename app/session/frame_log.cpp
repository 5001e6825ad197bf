#include "app/session/frame_log.h"

#include <algorithm>
#include <array>

#include "machine/description.h"
#include "machine/set_points.h"
#include "transport/canopen.h"

namespace knuckle::session {
namespace {

constexpr Duration kSilent = 50ms;       // a valve reports every 10 ms
constexpr Duration kSpringTime = 100ms;  // generous: spools spring to neutral in about 60 ms
constexpr Duration kUnderWay = 10ms;     // what was sent before a fault may reach the wire so much later

FrameLog::const_iterator first_at(const FrameLog& log, Time at) {
  return std::lower_bound(log.begin(), log.end(), at, [](const TimedFrame& f, Time t) { return f.at < t; });
}

bool tells_joint(std::uint32_t id, const BusDescription& bus) {
  for (const CommandFrame& frame : bus.commands)
    if (frame.id == id) return true;
  for (int joint = 0; joint < kJoints; ++joint)
    if (id == bus.set_point_id(joint)) return true;
  return false;
}

std::optional<std::size_t> valve_heard(std::uint32_t id, const MachineDescription& machine) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (id == machine.bus.spool_id(i)) return i;
  }
  return std::nullopt;
}

bool inside_dead_band(const CanFrame& frame, const MachineDescription& machine, std::size_t joint) {
  const ValveDescription& valve = machine.cylinders[joint].valve;
  const auto status = canopen::parse_valve_status(frame, machine.bus.wire.valve_full_stroke);
  return status && status->spool <= valve.dead_band_extend && status->spool >= -valve.dead_band_retract;
}

bool from_controller(const CanFrame& frame, const MachineDescription& machine) {
  if (tells_joint(frame.id, machine.bus)) return true;
  if (machine.bus.without_nodes()) return false;
  return frame.id == canopen::kNmtId || frame.id == canopen::kSyncId ||
         frame.id == canopen::heartbeat_id(machine.bus.controller_id) || frame.id == machine.bus.enable().rpdo_id() ||
         canopen::function_of(frame.id) == 0x600;
}

/// When the controller broke a silence that began at `from` and lasted for longer than the valves bear. nullopt: it was
/// never so silent. Time::max(): it did not speak again before `until`.
std::optional<Time> end_of_silence(const FrameLog& log, const MachineDescription& machine, Time from, Time until) {
  Time spoke_last = from;
  for (auto it = first_at(log, from); it != log.end() && it->at < until; ++it) {
    if (!from_controller(it->frame, machine)) continue;
    if (it->at - spoke_last >= from_seconds(machine.bus.valve_watchdog_s)) return it->at;
    if (it->at - from > kUnderWay) return std::nullopt;
    spoke_last = it->at;
  }
  const Time end = log.empty() ? from : std::min(until, log.back().at);
  if (end - spoke_last < from_seconds(machine.bus.valve_watchdog_s)) return std::nullopt;
  return Time::max();
}

/// A controller that said nothing until the spools were neutral gave no command to judge. @param spoke end_of_silence()
void note_silence(const std::optional<Time>& spoke, NeutralTimes& times) {
  times.controller_silent = times.spool && spoke && *spoke > *times.spool;
  if (times.controller_silent) times.command.reset();
}

/// The enable node says that there is no pilot pressure: nothing can hold a spool open.
bool pilot_off(const CanFrame& frame) {
  const auto inputs = canopen::parse_enable(frame);
  return inputs && (*inputs & canopen::kInputPilotOn) == 0;
}

bool all(const PerJoint<bool>& flags) {
  return std::all_of(flags.begin(), flags.end(), [](bool b) { return b; });
}

/// Of a machine that does not tell where its spools are: by the simulated ones.
std::optional<Time> closed_since(const std::vector<Sample>& samples, const MachineDescription& machine, Time from,
                                 Time until) {
  std::optional<Time> since;
  for (const Sample& sample : samples) {
    const Time at{from_seconds(sample.t_s)};
    if (at < from || at >= until) continue;
    bool closed = true;
    for (int joint = 0; joint < kJoints; ++joint) {
      const ValveDescription& valve = machine.cylinders[static_cast<std::size_t>(joint)].valve;
      const double spool = sample.truth.spool[joint];
      closed = closed && spool <= valve.dead_band_extend && spool >= -valve.dead_band_retract;
    }
    if (!closed)
      since.reset();
    else if (!since)
      since = at;
  }
  return since;
}

}  // namespace

NeutralTimes neutral_times(const FrameLog& log, const MachineDescription& machine, Time from, Time until) {
  NeutralTimes times;
  PerJoint<bool> command{true, true, true}, spool{true, true, true};
  std::optional<Time> pilot_off_since;
  PerJoint<Time> spool_at{};
  const auto note = [from](std::optional<Time>& since, const PerJoint<bool>& neutral, Time at) {
    if (!all(neutral)) {
      since.reset();
    } else if (!since && at >= from) {
      since = at;
    }
  };
  for (const TimedFrame& f : log) {
    if (f.at >= until) break;
    for (int joint = 0; joint < kJoints; ++joint)
      if (const auto told = set_point_in(f.frame, joint, machine.bus))
        command[static_cast<std::size_t>(joint)] = *told == 0;
    if (const auto i = valve_heard(f.frame.id, machine)) {
      spool[*i] = inside_dead_band(f.frame, machine, *i);
      spool_at[*i] = f.at;
    }
    if (f.frame.id == machine.bus.enable().tpdo_id()) {
      if (!pilot_off(f.frame)) {
        pilot_off_since.reset();
      } else if (!pilot_off_since) {
        pilot_off_since = f.at;
      }
    }
    // A valve that has gone silent shows no spool: without pilot pressure its spring has closed it.
    for (std::size_t i = 0; i < kJoints; ++i) {
      if (f.at - spool_at[i] > kSilent) spool[i] = pilot_off_since && f.at - *pilot_off_since > kSpringTime;
    }
    note(times.command, command, f.at);
    note(times.spool, spool, f.at);
  }
  note_silence(end_of_silence(log, machine, from, until), times);
  return times;
}

std::optional<Time> last_frame_before(const FrameLog& log, std::uint32_t id, Time before) {
  for (auto it = first_at(log, before); it != log.begin();) {
    if ((--it)->frame.id == id) return it->at;
  }
  return std::nullopt;
}

Time first_frame_from(const FrameLog& log, Time from) {
  const auto it = first_at(log, from);
  return it == log.end() ? Time::max() : it->at;
}

std::optional<Time> last_following(const FrameLog& log, const MachineDescription& machine, int joint, Time before) {
  constexpr double kTolerance = 0.1;
  const std::uint32_t told = machine.bus.set_point_id(joint), heard = machine.bus.spool_id(joint);
  std::array<double, 6> demands{};
  std::size_t next = 0;
  std::optional<Time> last;
  for (const TimedFrame& f : log) {
    if (f.at >= before) break;
    if (f.frame.id == told) {
      if (const auto command = canopen::parse_valve_command(f.frame, machine.bus.wire.valve_full_stroke)) {
        demands[next++ % demands.size()] = command->set_point;
      }
    } else if (f.frame.id == heard) {
      const auto [low, high] = std::minmax_element(demands.begin(), demands.end());
      const auto status = canopen::parse_valve_status(f.frame, machine.bus.wire.valve_full_stroke);
      if (status && status->spool >= *low - kTolerance && status->spool <= *high + kTolerance) last = f.at;
    }
  }
  return last;
}

int commands_not_neutral(const FrameLog& log, const MachineDescription& machine, Time from, Time until) {
  int count = 0;
  for (auto it = first_at(log, from); it != log.end() && it->at < until; ++it) {
    bool moves = false;
    for (int joint = 0; joint < kJoints; ++joint)
      moves = moves || set_point_in(it->frame, joint, machine.bus).value_or(0) != 0;
    count += moves ? 1 : 0;
  }
  return count;
}

void FaultWatch::step(Time now, Mode mode, const Reason& fault, bool enable) noexcept {
  for (Latched& latch : latched_) {
    latch.released = latch.released || !enable;
    if (latch.released && enable) latch.resumed_at = std::min(latch.resumed_at, now);
  }
  const bool latched_now = mode == Mode::kFault || mode == Mode::kEStop;
  if (latched_now && !was_latched_) keep(latched_, {fault, now}, lost_);
  was_latched_ = latched_now;
}

void FaultWatch::judge(const FrameLog& frames, const MachineDescription& machine, Time end,
                       const std::function<Cause(Time)>& cause_of, SessionRecord& record) const {
  record.records_lost += lost_;
  const auto seconds = [](const std::optional<Time>& t) { return t ? to_seconds(*t) : 0; };
  for (const Latched& latch : latched_) {
    const auto [last_good, injected_at, wire_ran_at] = cause_of(latch.at);
    const Time until = std::min(latch.resumed_at, end);
    NeutralTimes neutral = neutral_times(frames, machine, last_good, until);
    if (machine.bus.by_frames()) {
      neutral.spool = closed_since(record.samples, machine, last_good, until);
      note_silence(end_of_silence(frames, machine, last_good, until), neutral);
    }
    record.faults.push_back({latch.reason,
                             to_seconds(latch.at),
                             to_seconds(last_good),
                             seconds(neutral.command),
                             seconds(neutral.spool),
                             neutral.controller_silent,
                             {}});
    if (injected_at) record.faults.back().injected_s = to_seconds(*injected_at);
    const Time all_came = std::max(latch.at, std::min(wire_ran_at, until)) + kUnderWay;
    if (commands_not_neutral(frames, machine, all_came, until) > 0) ++record.resumed_by_itself;
  }
}

}  // namespace knuckle::session
