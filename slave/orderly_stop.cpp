#include "slave/orderly_stop.h"

#include <algorithm>

#include "machine/description.h"
#include "machine/pilot_spool.h"
#include "slave/node_setup.h"
#include "slave/sensors.h"
#include "transport/j1939.h"

namespace knuckle::slave {
namespace {

constexpr Duration kNeutralPatience = 320ms;  // as long as a spool may take to be neutral
constexpr Duration kDisablePatience = 200ms;
constexpr Duration kReleasePatience = 100ms;

bool carries(const CanFrame& frame, const BroadcastFrame* sent) noexcept {
  return sent != nullptr && sent->filter().lets(frame.id) && sent->is_in(frame) &&
         (!sent->source || j1939::source_of(frame.id) == *sent->source);
}

/// nullopt where the frame says that there is no value.
std::optional<double> value_in(const CanFrame& frame, const BusDescription::Broadcast& told) noexcept {
  if (check_frame(told.frame->closing, std::nullopt, frame).fault != FrameFault::kNone) return std::nullopt;
  return told.field->value(read_raw(told.field->bits, frame));
}

}  // namespace

OrderlyStop::OrderlyStop(const MachineDescription& machine, CanBus& bus)
    : machine_(machine), bus_(bus), commands_(machine.bus) {
  for (const NodeDescription& node : machine.bus.nodes) held_.push_back(node.id);
  // What nobody tells cannot be waited for.
  pilot_off_ = !tells_pilot();
}

bool OrderlyStop::tells_pilot() const noexcept {
  return machine_.bus.has_enable() || machine_.bus.broadcast(NodeRole::kEnable, kPilotOnIndex).field != nullptr;
}

void OrderlyStop::step(Time now, bool has_address) noexcept {
  has_address_ = has_address;
  if (done()) return;
  const bool first = phase_since_ == kNever;
  if (first) phase_since_ = now;
  hear();
  if (phase_ != Phase::kRelease && !machine_.bus.without_nodes()) bus_.send(canopen::sync_frame());
  ++syncs_;
  switch (phase_) {
    case Phase::kNeutral:
      send_commands(&ValveWords::hold, first, now);
      if (!first && (at_rest() || now - phase_since_ >= kNeutralPatience)) enter(Phase::kDisable, now);
      break;
    case Phase::kDisable:
      if (!confirmed() && now - phase_since_ < kDisablePatience) {
        send_commands(&ValveWords::disabled, false, now);
        ask_resting();
        break;
      }
      if (!machine_.bus.without_nodes())
        bus_.send(canopen::heartbeat_frame(machine_.bus.controller_id, canopen::NmtState::kStopped));
      enter(Phase::kRelease, now);
      return;
    case Phase::kRelease:
      // Pre-operational as after power-on: nodes that went on watching our heartbeat would call its silence a fault.
      // But the reset also erases their watchdogs (0x1016, 0x1400:05), all that is left where one did not obey. Then
      // nothing is sent: operational, with both watchdogs on, is the one state in which every node ends its outputs by
      // itself. Nor may it reset what another controller leads, or nodes that are not of this machine.
      if (confirmed() && alone_) {
        while (!held_.empty() && bus_.send(canopen::nmt_frame(canopen::NmtCommand::kResetCommunication, held_.back())))
          held_.pop_back();
        // A queue that is full takes the rest in the next step.
        if (!held_.empty() && now - phase_since_ < kReleasePatience) return;
      }
      phase_ = Phase::kDone;
      return;
    case Phase::kDone:
      return;
  }
  heartbeat(now);
}

void OrderlyStop::enter(Phase phase, Time now) noexcept {
  phase_ = phase;
  phase_since_ = now;
  if (phase != Phase::kDisable) return;
  valves_ = {};  // reports from before the command confirm nothing
  pilots_ = {};
  pilot_off_ = !tells_pilot();
}

void OrderlyStop::hear() noexcept {
  CanFrame frame;
  for (int i = 0; i < kMostFramesPerStep && bus_.receive(frame); ++i) {
    alone_ = alone_ && frame.id != canopen::kSyncId;
    if (const auto told = machine_.bus.broadcast(NodeRole::kEnable, kPilotOnIndex); carries(frame, told.frame)) {
      const auto value = value_in(frame, told);
      pilot_off_ = value && *value != static_cast<double>(told.field->on);
    }
    hear_pilots(frame);
    if (machine_.bus.without_nodes()) continue;
    const std::uint8_t node = canopen::node_of(frame.id);
    if (const auto state = canopen::parse_heartbeat(frame)) resting_[node] = *state != canopen::NmtState::kOperational;
    if (const auto answer = canopen::parse_sdo_response(frame)) hear_answer(node, *answer);
    if (machine_.bus.has_enable() && frame.id == machine_.bus.enable().tpdo_id()) {
      const auto inputs = canopen::parse_enable(frame);
      if (inputs) pilot_off_ = (*inputs & canopen::kInputPilotOn) == 0;
    }
    for (std::size_t j = 0; !machine_.bus.by_frames() && j < kJoints; ++j) {
      if (frame.id != machine_.bus.spool_id(j)) continue;
      if (const auto status = canopen::parse_valve_status(frame, machine_.bus.wire.valve_full_stroke))
        valves_[j] = {true, status->status_word, status->spool};
    }
  }
}

void OrderlyStop::hear_pilots(const CanFrame& frame) noexcept {
  for (int line = 0; line < 2 * kJoints; ++line) {
    const auto told = machine_.bus.broadcast(NodeRole::kPilot, line);
    if (!carries(frame, told.frame)) continue;
    Pilot& pilot = pilots_[static_cast<std::size_t>(line / 2)];
    const auto value_Pa = value_in(frame, told);
    const bool known = value_Pa && possible_pilot(*told.field, *value_Pa);
    (line % 2 == 0 ? pilot.extend_Pa : pilot.retract_Pa) = known ? value_Pa : std::nullopt;
  }
}

void OrderlyStop::hear_answer(std::uint8_t node, const canopen::SdoResponse& answer) noexcept {
  if (!resting_[node]) return;  // its process data say it
  const auto inputs = answered(answer, canopen::kEnableInputs);
  if (inputs && node == machine_.bus.enable().id) pilot_off_ = (*inputs & canopen::kInputPilotOn) == 0;
  for (int j = 0; j < kJoints; ++j) {
    const auto word = answered(answer, valve_object(machine_.bus, j, canopen::kValveStatusWord));
    if (!word || node != machine_.bus.valve(j).id) continue;
    Valve& valve = valves_[static_cast<std::size_t>(j)];
    valve.heard = true;
    valve.status_word = static_cast<std::uint16_t>(*word);
  }
}

/// One question in every other step: a driver of several axes answers one after the other.
void OrderlyStop::ask_resting() noexcept {
  const int turn = syncs_ / 2 % (kJoints + 1);
  if (syncs_ % 2 != 0) return;
  const std::uint8_t enable = machine_.bus.enable().id;
  if (turn == kJoints) {
    if (machine_.bus.has_enable() && resting_[enable] && !pilot_off_)
      bus_.send(canopen::sdo_upload(enable, canopen::kEnableInputs));
    return;
  }
  const std::uint8_t valve = machine_.bus.valve(turn).id;
  if (!machine_.bus.by_frames() && resting_[valve] && !disabled(valves_[static_cast<std::size_t>(turn)]))
    bus_.send(canopen::sdo_upload(valve, valve_object(machine_.bus, turn, canopen::kValveStatusWord)));
}

void OrderlyStop::send_commands(std::uint16_t ValveWords::*state, bool at_once, Time now) noexcept {
  if (machine_.bus.by_frames()) commands_.step(PassedCommands(), false, bus_, now, has_address_);
  if (!at_once && syncs_ % machine_.bus.set_point_every_nth_sync != 0) return;
  const PassedCommands neutral;
  for (int j = 0; !machine_.bus.by_frames() && j < kJoints; ++j) {
    const ValveWords words = valve_words(machine_.bus.valve(j).profile);
    bus_.send(valve_frame(machine_.bus, j, words.*state, neutral));
  }
  if (!machine_.bus.has_enable()) return;
  bus_.send(canopen::enable_output_frame(machine_.bus.enable().rpdo_id(), 0));
}

void OrderlyStop::heartbeat(Time now) noexcept {
  if (machine_.bus.without_nodes()) return;
  if (to_seconds(now - heartbeat_at_) < machine_.bus.controller_heartbeat_s - 1e-6) return;
  bus_.send(canopen::heartbeat_frame(machine_.bus.controller_id, canopen::NmtState::kOperational));
  heartbeat_at_ = now;
}

/// By its pilot pressures.
bool OrderlyStop::is_shut(int joint) const noexcept {
  const Pilot& pilot = pilots_[static_cast<std::size_t>(joint)];
  if (!tells_pilots(machine_.bus, joint) || !pilot.extend_Pa || !pilot.retract_Pa) return false;
  return PilotSpool(machine_, joint).opening(*pilot.extend_Pa, *pilot.retract_Pa) == 0;
}

/// Where nobody tells it, no spool is known to be.
bool OrderlyStop::at_rest() const noexcept {
  if (machine_.bus.by_frames()) return is_shut(kBoom) && is_shut(kArm) && is_shut(kBucket);
  for (std::size_t j = 0; j < kJoints; ++j) {
    const ValveDescription& nominal = machine_.cylinders[j].valve;
    const Valve& valve = valves_[j];
    if (!valve.heard || valve.spool > nominal.dead_band_extend || valve.spool < -nominal.dead_band_retract)
      return false;
  }
  return true;
}

bool OrderlyStop::disabled(const Valve& valve) const noexcept {
  if (!valve.heard) return false;
  const auto state = canopen::valve_state(valve.status_word);
  return state == canopen::ValveState::kDisabled || state == canopen::ValveState::kInit;
}

bool OrderlyStop::confirmed() const noexcept {
  if (machine_.bus.by_frames()) {
    const auto open = unconfirmed_valves();
    return pilot_off_ && std::none_of(open.begin(), open.end(), [](bool is) { return is; });
  }
  return pilot_off_ && std::all_of(valves_.begin(), valves_.end(), [this](const Valve& v) { return disabled(v); });
}

PerJoint<bool> OrderlyStop::unconfirmed_valves() const noexcept {
  PerJoint<bool> open{};
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto j = static_cast<std::size_t>(joint);
    open[j] = machine_.bus.by_frames() ? tells_pilots(machine_.bus, joint) && !is_shut(joint) : !disabled(valves_[j]);
  }
  return open;
}

}  // namespace knuckle::slave
