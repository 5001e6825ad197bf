#include "slave/canopen_client.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "machine/bus_frames.h"
#include "machine/description.h"
#include "machine/reason_text.h"
#include "slave/home_on_two.h"
#include "slave/valve_frame.h"

namespace knuckle::slave {
namespace {

constexpr double kSpoolPossible = 1.1;  // of stroke; devices send the largest integer (2.0) for "broken"
// An event-driven enable node repeats its inputs at the heartbeat's rate; three may be lost.
constexpr int kInputPeriods = 3;

SdoScript error_script() {
  return {{SetupPart::Kind::kRequire, {{canopen::kErrorRegister, 0, 1}}, {}}};
}

/// Process data that has not come for too long, or only in frames too short to have a value.
Reason missing(std::uint8_t subject, std::optional<std::uint8_t> short_bytes, const canopen::PdoMap& map, double age_s,
               double limit_s) noexcept {
  if (short_bytes) return Reason(ReasonCode::kFrameShort, subject, *short_bytes, canopen::bytes_of(map));
  return Reason(ReasonCode::kSensorStale, subject, age_s * 1e3, limit_s * 1e3);
}

/// SDO requests a step. All nodes at once would fill the bus for longer than the nodes wait for the controller's
/// heartbeat, which has the lowest priority of all.
int most_requests(const BusDescription& bus) noexcept {
  constexpr double kShare = 0.75, kRequestAndAnswer_bits = 270;  // of 8 bytes, at worst stuffing
  return std::max(1, static_cast<int>(kShare * bus.bit_rate / bus.sync_Hz / kRequestAndAnswer_bits));
}

/// It opens as the bus tells it, and only then.
bool is_active(std::uint16_t status_word) noexcept {
  return canopen::valve_state(status_word) == canopen::ValveState::kActive &&
         (status_word & canopen::kStatusLocal) == 0 && !canopen::valve_fault(status_word);
}

/// Of a node that rests after this command; nullopt where it works or starts anew.
std::optional<canopen::NmtState> state_after(canopen::NmtCommand command) noexcept {
  if (command == canopen::NmtCommand::kStop) return canopen::NmtState::kStopped;
  if (command == canopen::NmtCommand::kEnterPreOperational) return canopen::NmtState::kPreOperational;
  return std::nullopt;
}

/// An error-passive controller has counted 128 errors more than an eighth of its good frames: nobody acknowledges it,
/// or the bus is no longer one to move a machine by.
Reason bus_fault(const CanBus& bus) noexcept {
  switch (bus.state()) {
    case CanState::kActive:
      return {};
    case CanState::kPassive:
      return {ReasonCode::kBusPassive, bus.state_of()};
    case CanState::kBusOff:
      return {ReasonCode::kBusOff, bus.state_of()};
    case CanState::kDown:
      break;
  }
  return {ReasonCode::kBusDown, bus.state_of()};
}

}  // namespace

CanopenClient::CanopenClient(const MachineDescription& machine, CanBus& bus)
    : description_(machine.bus),
      commands_(machine.bus),
      bus_(bus),
      watch_(machine.bus),
      most_asked_(most_requests(machine.bus)) {
  for (NodeScript& entry : node_scripts(machine)) {
    const NodeDescription& node = entry.node;
    if (node.id < 1 || node.id > 127 || index_[node.id] != 0 || node.id == description_.controller_id)
      throw InputError(machine.source + ": bus: node id " + std::to_string(node.id) + " is not free or not in 1...127");
    const Duration timeout = from_seconds(description_.sdo_timeout_s);
    PerJoint<bool> moves{};
    for (const NodeChannel& channel : node.channels)
      if (node.role == NodeRole::kValve) moves[static_cast<std::size_t>(channel.info().index)] = true;
    std::optional<int> pressures;
    for (int joint = 0; joint < kJoints; ++joint)
      if (only_pressures_of(joint, node)) pressures = joint;
    nodes_.push_back(
        {node.id, moves, pressures, true, std::max(description_.boot_timeout_s, valve_boot_s(node.profile)),
         SdoDialogue(node.id, std::move(entry.before_rest), timeout),
         SdoDialogue(node.id, std::move(entry.script), timeout), SdoDialogue(node.id, error_script(), timeout)});
    index_[node.id] = static_cast<std::uint8_t>(nodes_.size());
  }
  restart();
}

CanopenClient::Node* CanopenClient::find(std::uint8_t id) noexcept {
  return index_[id] == 0 ? nullptr : &nodes_[index_[id] - 1U];
}
const CanopenClient::Node* CanopenClient::find(std::uint8_t id) const noexcept {
  return index_[id] == 0 ? nullptr : &nodes_[index_[id] - 1U];
}

void CanopenClient::withhold(Withheld what, std::uint8_t node) noexcept {
  withheld_ = what;
  if (what == Withheld::kNothing) return;
  tried_ = node;
}

CanopenClient::Withheld CanopenClient::guarded_by(std::uint8_t node) const noexcept {
  const Node* of = find(node);
  if (of == nullptr || node == description_.enable().id) return Withheld::kHeartbeat;
  bool timed = false;
  for (const std::uint8_t pdo : receive_pdos(*description_.find(node)))
    timed = timed || of->dialogue.took(
                         {static_cast<std::uint16_t>(canopen::kRpdo1Timer.index + pdo), canopen::kRpdo1Timer.subindex});
  const bool alone = !timed && of->dialogue.took(canopen::kConsumerHeartbeat);
  return alone ? Withheld::kHeartbeat : Withheld::kSetPoints;
}

bool CanopenClient::waits_for_heartbeat(std::uint8_t node) const noexcept {
  const Node* of = find(node);
  return of != nullptr && of->dialogue.took(canopen::kConsumerHeartbeat);
}

std::uint16_t CanopenClient::emergency_of(std::uint8_t node) const noexcept {
  const Node* of = find(node);
  return of == nullptr ? canopen::kEmcyReset : of->emergency;
}

bool CanopenClient::says_stopped(std::uint8_t node) const noexcept {
  const Node* of = find(node);
  if (of == nullptr) return false;
  bool inactive = false;
  for (std::size_t j = 0; j < kJoints; ++j) inactive = inactive || (of->moves[j] && !is_active(valves_[j].status_word));
  return of->emergency != canopen::kEmcyReset || of->lost || inactive;
}

bool CanopenClient::same_device(std::uint8_t node) const noexcept {
  const Node* of = find(node);
  return of == nullptr || of->dialogue.same_device();
}

void CanopenClient::need_pressures(int joint, bool on) noexcept {
  for (Node& node : nodes_)
    if (node.pressures == joint) node.needed = on;
}

/// Where one stops, the enable node may take pilot pressure away; without that, valves may stop.
bool CanopenClient::excused(const Node& node) const noexcept {
  const std::uint8_t enable = description_.enable().id;
  return tried_ != 0 && (node.id == tried_ || node.id == enable || tried_ == enable);
}

void CanopenClient::restart() noexcept {
  for (Node& node : nodes_) {
    node.before_rest.restart();
    node.dialogue.restart();
    node.errors.restart();
    node.told = node.operational = false;
    node.boots_since = kNever;
    node.emergency = canopen::kEmcyReset;
    node.lost = {};
  }
  forget_process_data();
  fault_ = {};
  setup_failure_ = {};
  watch_.restart();
  demand_.setZero();
  withheld_ = Withheld::kNothing;
  tried_ = 0;
  syncs_ = 0;  // neutral goes out with the next step
  phase_ = Phase::kIdle;
}

/// Of nodes that start anew nothing is known, and nothing was told to their outputs.
void CanopenClient::forget_process_data() noexcept {
  valves_ = {};
  for (std::size_t j = 0; j < kJoints; ++j) valves_[j].control_word = valve_words(description_.valve(j).profile).init;
  inputs_seen_at_ = kNever;
  short_inputs_.reset();
  inputs_closed_ = pilot_on_ = false;
  enable_sent_.reset();
}

void CanopenClient::enter(Phase phase, Time now) noexcept {
  phase_ = phase;
  phase_since_ = now;
}

void CanopenClient::fail(const Reason& why) noexcept {
  fault_ = why;
  phase_ = Phase::kFailed;
}

bool CanopenClient::receive(const CanFrame& frame, Time now) noexcept {
  watch_.receive(frame, now);
  if (const auto request = canopen::parse_nmt(frame)) {
    on_nmt(*request);
    return true;
  }
  if (on_pdo(frame, now)) return true;
  Node* node = find(canopen::node_of(frame.id));
  if (node == nullptr) return false;
  const std::uint8_t id = node->id;
  if (frame.id == canopen::sdo_response_id(id)) {
    on_answer(*node, frame, now);
  } else if (frame.id == canopen::sdo_request_id(id)) {
    node->before_rest.others_asked();
    node->dialogue.others_asked();
    node->errors.others_asked();
  } else if (frame.id == canopen::heartbeat_id(id)) {
    on_heartbeat(*node, frame, now);
  } else if (frame.id == canopen::emcy_id(id)) {
    on_emergency(*node, frame, now);
  } else {
    return false;
  }
  return true;
}

/// Somebody else takes one node out of its working state: that is known before its heartbeat says so.
void CanopenClient::on_nmt(const canopen::NmtRequest& request) noexcept {
  if (phase_ != Phase::kOperational) return;
  const auto left = state_after(request.command);
  Node* told = find(request.node);
  if (told == nullptr || !left || told->lost) return;
  told->lost = Reason(ReasonCode::kNodeFault, told->id, static_cast<double>(*left),
                      static_cast<double>(canopen::NmtState::kOperational));
}

void CanopenClient::on_answer(Node& node, const CanFrame& frame, Time now) noexcept {
  // Of others nobody asks: an answer to somebody else must not pass for process data that no longer come.
  const auto answer = node.id == tried_ ? canopen::parse_sdo_response(frame) : std::nullopt;
  if (answer) on_asked(node, *answer, now);
  node.asked().receive(frame);
  watch_.note_second_answers(node.id, std::max({node.before_rest.second_answers(), node.dialogue.second_answers(),
                                                node.errors.second_answers()}));
}

void CanopenClient::ask(std::uint8_t node, int joint) noexcept {
  if (node != tried_) return;
  const bool enable = node == description_.enable().id;
  bus_.send(canopen::sdo_upload(
      node, enable ? canopen::kEnableInputs : valve_object(description_, joint, canopen::kValveActual)));
}

void CanopenClient::on_asked(const Node& node, const canopen::SdoResponse& answer, Time now) noexcept {
  const auto inputs = answered(answer, canopen::kEnableInputs);
  if (inputs && node.id == description_.enable().id) take_inputs(static_cast<std::uint8_t>(*inputs), now);
  for (int j = 0; j < kJoints; ++j) {
    const auto steps = answered(answer, valve_object(description_, j, canopen::kValveActual));
    if (!steps || !node.moves[static_cast<std::size_t>(j)]) continue;
    spool_[j] = static_cast<std::int16_t>(*steps) / description_.wire.valve_full_stroke;
    valves_[static_cast<std::size_t>(j)].seen_at = now;
  }
}

void CanopenClient::on_emergency(Node& node, const CanFrame& frame, Time now) noexcept {
  const auto emergency = canopen::parse_emergency(frame);
  if (!emergency) return;
  // Of several errors one may be over: the register says whether any is left (CiA 301).
  const bool over = emergency->code == canopen::kEmcyReset;
  if (!over) {
    node.emergency = emergency->code;
  } else if (emergency->error_register == 0) {
    node.emergency = canopen::kEmcyReset;
  } else if (node.emergency == canopen::kEmcyReset) {
    node.emergency = canopen::kEmcyGeneric;
  }
  emergencies_.add(now, node.id, *emergency);
}

/// Valves' status and the enable node's inputs.
bool CanopenClient::on_pdo(const CanFrame& frame, Time now) noexcept {
  for (std::size_t i = 0; spools_seen() && i < kJoints; ++i) {
    if (frame.id != description_.spool_id(i)) continue;
    on_valve_status(static_cast<int>(i), frame, now);
    return true;
  }
  if (!description_.has_enable() || frame.id != description_.enable().tpdo_id()) return false;
  on_inputs(frame, now);
  return true;
}

void CanopenClient::on_inputs(const CanFrame& frame, Time now) noexcept {
  const auto inputs = canopen::parse_enable(frame);
  if (!inputs) return void(short_inputs_ = frame.size);
  short_inputs_.reset();
  take_inputs(*inputs, now);
}

void CanopenClient::take_inputs(std::uint8_t inputs, Time now) noexcept {
  inputs_seen_at_ = now;
  inputs_closed_ = (inputs & canopen::kInputEStopClosed) != 0;
  pilot_on_ = (inputs & canopen::kInputPilotOn) != 0;
}

void CanopenClient::on_heartbeat(Node& node, const CanFrame& frame, Time now) noexcept {
  const auto state = canopen::parse_heartbeat(frame);
  if (!state) return;
  const bool in_time = to_seconds(now - node.heard_at) <= description_.node_heartbeat_timeout_s;
  node.heard_at = now;
  const bool boots = *state == canopen::NmtState::kBootUp;
  node.operational = *state == canopen::NmtState::kOperational;
  if (boots && phase_ == Phase::kConfiguring && !node.dialogue.begun()) {
    node.boots_since = kNever;
    node.told = false;
    node.before_rest.restart();
    node.dialogue.restart();
    return;
  }
  // A node that rebooted has lost its configuration: it may not simply join (again), however far the start-up is.
  const bool started = phase_ >= Phase::kActivating && phase_ <= Phase::kOperational;
  const bool rebooted = boots && node.dialogue.begun();
  // A node that stops working is missed before its next heartbeat tells why.
  const bool missed = phase_ == Phase::kFailed && fault_.code == ReasonCode::kSensorStale &&
                      node_of(fault_, description_) == description_.find(node.id);
  if (node.lost || !(rebooted || ((started || (missed && in_time)) && !node.operational))) return;
  node.lost = Reason(ReasonCode::kNodeFault, node.id, static_cast<double>(*state),
                     static_cast<double>(canopen::NmtState::kOperational));
  if (missed) fault_ = node.lost;
}

void CanopenClient::on_valve_status(int joint, const CanFrame& frame, Time now) noexcept {
  const auto status = canopen::parse_valve_status(frame, description_.wire.valve_full_stroke);
  Valve& valve = valves_[static_cast<std::size_t>(joint)];
  if (!status) return void(valve.short_bytes = frame.size);
  valve.short_bytes.reset();
  valve.status_word = status->status_word;
  valve.seen_at = now;
  valve.spool = status->spool;
  spool_[joint] = status->spool;
}

/// Nobody starts the nodes of a machine that somebody else leads: as long as he is heard, nothing starts anew.
void CanopenClient::begin_step(Time now) noexcept {
  told_now_ = asked_now_ = 0;
  watch_.step(now);
  watch_.count_frames(phase_ >= Phase::kActivating && phase_ <= Phase::kOperational);
  if (const Reason why = bus_fault(bus_)) fail(why);
  if (const Reason why = watch_.foreign(now)) {
    // First what has become of a node that was told to rest, then that somebody told it so.
    const auto rests = std::find_if(nodes_.begin(), nodes_.end(),
                                    [](const Node& n) { return n.needed && n.lost && n.lost.value > 0; });
    fail(phase_ == Phase::kOperational && rests != nodes_.end() ? rests->lost : why);
  } else if (const Reason id_twice = watch_.twice()) {
    fail(id_twice);
  }
  step_phase(now);
}

void CanopenClient::step_phase(Time now) noexcept {
  switch (phase_) {
    case Phase::kIdle:
      commanded_ = true;
      enter(Phase::kConfiguring, now);
      return configure(now);
    case Phase::kConfiguring:
      return configure(now);
    case Phase::kStarting:
      return start_nodes(now);
    case Phase::kActivating:
      return activate(now);
    case Phase::kChecking:
      return check_errors(now);
    case Phase::kOperational:
      if (const Reason why = supervise(now)) fail(why);
      return;
    case Phase::kFailed:
      return;
  }
}

/// Of its node: an axis that fails is a device that fails.
Reason CanopenClient::valve_fault(std::size_t joint, Time now) const noexcept {
  const Valve& valve = valves_[joint];
  const std::uint8_t spool = subject_of(NodeRole::kValve, static_cast<int>(joint), description_);
  const std::uint8_t id = description_.valve(joint).id;
  if (std::abs(valve.spool) > kSpoolPossible)
    return Reason(ReasonCode::kSensorInvalid, spool, valve.spool, kSpoolPossible);
  const double age_s = to_seconds(now - valve.seen_at);
  const double age_limit_s =
      description_.sensor_age_limit_s + description_.valve_status_every_nth_sync / description_.sync_Hz;
  bool node_heard = false;
  for (std::size_t j = 0; j < kJoints; ++j)
    node_heard = node_heard || (description_.valve(j).id == id && to_seconds(now - valves_[j].seen_at) <= age_limit_s);
  if (age_s > age_limit_s)
    return missing(node_heard ? spool : id, valve.short_bytes, canopen::kValveTpdo, age_s, age_limit_s);
  if (is_active(valve.status_word)) return {};
  return Reason(ReasonCode::kNodeFault, id, valve.status_word, canopen::kControlActive | canopen::kStatusReady);
}

Reason CanopenClient::supervise(Time now) const noexcept {
  const double limit_s = description_.node_heartbeat_timeout_s;
  for (const Node& node : nodes_) {
    if (!node.needed || excused(node)) continue;
    if (node.emergency != canopen::kEmcyReset)
      return Reason(ReasonCode::kNodeEmergency, node.id, node.emergency, canopen::kEmcyReset);
    if (node.lost) return node.lost;
    const double silent_s = to_seconds(now - node.heard_at);
    if (silent_s > limit_s) return Reason(ReasonCode::kNodeSilent, node.id, silent_s * 1e3, limit_s * 1e3);
    for (std::size_t j = 0; j < kJoints; ++j) {
      if (!node.moves[j]) continue;
      if (const Reason why = valve_fault(j, now)) return why;
    }
  }
  if (!description_.has_enable()) return {};
  const double age_s = to_seconds(now - inputs_seen_at_);
  const double age_limit_s = kInputPeriods * description_.controller_heartbeat_s;
  if (age_s > age_limit_s && tried_ != description_.enable().id)
    return missing(description_.enable().id, short_inputs_, canopen::kEnableTpdo, age_s, age_limit_s);
  return {};
}

void CanopenClient::end_step(const PassedCommands& commands, bool led, Time now, bool may_command) noexcept {
  if (!commanded_ && watch_.foreign(now)) return;  // somebody else's machine, until now
  commanded_ = true;
  // From the first frame on: what a node was told before this start must not become true again when it is started.
  const bool operational = phase_ == Phase::kOperational;
  if (spools_seen())
    send_set_points(operational ? commands : PassedCommands(), now);
  else
    commands_.step(operational ? commands : PassedCommands(), led && operational, bus_, now, may_command,
                   withheld_ == Withheld::kSetPoints ? std::optional(tried_) : std::nullopt);
  if (description_.has_enable()) send_enable(led && operational);
  if (description_.without_nodes()) return;
  const bool heartbeat_due = to_seconds(now - heartbeat_at_) >= description_.controller_heartbeat_s - 1e-6;
  if (heartbeat_due && withheld_ != Withheld::kHeartbeat) {
    bus_.send(canopen::heartbeat_frame(description_.controller_id, canopen::NmtState::kOperational));
    heartbeat_at_ = now;
  }
  // Last, as every sensor answers it at once, with frames that go before set-points.
  if (bus_.send(canopen::sync_frame())) watch_.synced();
  ++syncs_;
}

void CanopenClient::send_enable(bool on) noexcept {
  const std::uint8_t output = on ? canopen::kOutputEnable : 0;
  if (output == enable_sent_ && syncs_ % std::uint32_t{BusDescription::kEnableEveryNthSync} != 0) return;
  if (bus_.send(canopen::enable_output_frame(description_.enable().rpdo_id(), output))) enable_sent_ = output;
}

/// A frame that the controller's queue does not take is dropped: the next one is newer.
void CanopenClient::send_set_points(const PassedCommands& commands, Time now) noexcept {
  const bool due = syncs_ % static_cast<std::uint32_t>(description_.set_point_every_nth_sync) == 0;
  for (int i = 0; i < kJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const bool dropped = commands[i] == 0 && demand_[i] != 0;
    if (!due && !dropped) continue;
    if (withheld_ == Withheld::kSetPoints && tried_ == description_.valve(i).id) continue;
    const std::uint16_t control_word = valves_[joint].control_word;
    if (bus_.send(valve_frame(description_, i, control_word, commands))) {
      demand_[i] = commands[i];
      set_points_at_ = now;
      valves_[joint].sent_word = control_word;
    }
  }
}

}  // namespace knuckle::slave
