// The client's way up: every node asked and set up, started, valves to ACTIVE, no error left.
#include <algorithm>

#include "slave/canopen_client.h"
#include "slave/valve_frame.h"

namespace knuckle::slave {
namespace {

/// A module's outputs have the device's defaults after a reset, which need not be neutral.
bool may_be_reset(const BusDescription& bus, std::uint8_t id) noexcept {
  const NodeDescription* const node = bus.find(id);
  return node == nullptr || node->outputs == 0;
}

}  // namespace

/// Once: what a full queue does not take goes out in a later step, and only a few go out in one, as SYNC is behind
/// them.
bool CanopenClient::tell(Node& node, canopen::NmtCommand command) noexcept {
  if (node.told || told_now_ == kMostToldAtOnce) return node.told;
  node.told = bus_.send(canopen::nmt_frame(command, node.id));
  ++told_now_;
  return node.told;
}

/// The last resort: it costs the node's self-test, and all that it was told.
/// @returns false where the queue is full: in a later step.
bool CanopenClient::reset(Node& node, Time now) noexcept {
  if (!bus_.send(canopen::nmt_frame(canopen::NmtCommand::kResetNode, node.id))) return false;
  node.was_reset = true;
  node.boots_since = now;
  node.told = false;
  node.dialogue.restart();
  return true;
}

/// A module that runs takes its error values as soon as it is told to rest: they are set before, in whatever state it
/// is. One that is stopped answers nothing, and has taken them already.
/// @returns whether it may be told.
bool CanopenClient::may_rest(Node& node, Time now) noexcept {
  SdoDialogue& first = node.before_rest;
  if (asked_now_ < most_asked_ && first.step(bus_, now)) ++asked_now_;
  if (!first.failure()) return first.done();
  if (first.details().what == SetupFailure::What::kSilent) {
    if (!node.operational) return true;
    if (to_seconds(now - phase_since_) <= node.boot_s + kSdoAttempts * description_.sdo_timeout_s) {
      first.restart();
      return false;
    }
  }
  setup_failure_ = first.details();
  fail(first.failure());
  return false;
}

/// @returns whether this node is set up.
bool CanopenClient::set_up(Node& node, Time now) noexcept {
  // One that never says it booted still gets its chance: its SDO time-out then names it.
  if (node.boots_since != kNever && to_seconds(now - node.boots_since) <= node.boot_s) return false;
  node.boots_since = kNever;
  if (!may_rest(node, now)) return false;
  if (!tell(node, canopen::NmtCommand::kEnterPreOperational)) return false;
  if (asked_now_ < most_asked_ && node.dialogue.step(bus_, now)) ++asked_now_;
  if (!node.dialogue.failure()) return node.dialogue.done();
  const SetupFailure& failure = node.dialogue.details();
  using What = SetupFailure::What;
  const double patience_s = node.boot_s + kSdoAttempts * description_.sdo_timeout_s;
  if (failure.what == What::kSilent && to_seconds(now - phase_since_) <= patience_s) {
    node.told = false;  // it may be booting: then it has heard nothing
    node.dialogue.restart();
  } else if (!node.was_reset && may_be_reset(description_, node.id) &&
             (failure.what == What::kNotKept || (failure.what == What::kAborted && failure.writing))) {
    (void)reset(node, now);
  } else {
    setup_failure_ = failure;
    fail(node.dialogue.failure());
  }
  return false;
}

void CanopenClient::configure(Time now) noexcept {
  bool done = true;
  for (Node& node : nodes_) {
    if (!node.needed) continue;
    done = set_up(node, now) && done;
    if (node.lost) return fail(node.lost);
    if (phase_ == Phase::kFailed) return;
  }
  if (!done) return;
  for (Node& node : nodes_) node.told = node.operational = false;
  enter(Phase::kStarting, now);
  start_nodes(now);
}

void CanopenClient::start_nodes(Time now) noexcept {
  bool all = true;
  for (Node& node : nodes_) {
    if (!node.needed) continue;
    if (node.lost) return fail(node.lost);
    all = tell(node, canopen::NmtCommand::kStart) && node.operational && all;
  }
  if (all) return enter(Phase::kActivating, now);
  if (to_seconds(now - phase_since_) <= description_.start_timeout_s) return;
  const auto late =
      std::find_if(nodes_.begin(), nodes_.end(), [](const Node& n) { return n.needed && (!n.told || !n.operational); });
  fail({ReasonCode::kNodeSilent, late->id, to_ms(now - phase_since_), description_.start_timeout_s * 1e3});
}

/// What the node last called its error.
std::uint16_t CanopenClient::newest_error(std::uint8_t node) const noexcept {
  for (std::size_t i = 0; i < emergencies_.kept(); ++i) {
    const EmergencyRecord& entry = emergencies_.newest(i);
    if (entry.node == node && entry.emergency.code != canopen::kEmcyReset) return entry.emergency.code;
  }
  return canopen::kEmcyGeneric;
}

/// An emergency is sent once: whether its error is still there, and whether there is one from before this controller
/// listened, only the node's error register says (CiA 301).
void CanopenClient::check_errors(Time now) noexcept {
  bool all = true;
  for (Node& node : nodes_) {
    if (!node.needed) continue;
    if (node.lost) return fail(node.lost);
    if (asked_now_ < most_asked_ && node.errors.step(bus_, now)) ++asked_now_;
    all = all && node.errors.done();
    if (!node.errors.failure()) continue;
    if (node.errors.details().what != SetupFailure::What::kOtherValue) {
      setup_failure_ = node.errors.details();
      return fail(node.errors.failure());
    }
    if (node.was_reset || !may_be_reset(description_, node.id))
      return fail(Reason(ReasonCode::kNodeEmergency, node.id, newest_error(node.id), canopen::kEmcyReset));
    if (!reset(node, now)) return;
    forget_process_data();
    for (Node& other : nodes_) {
      other.told = false;
      other.dialogue.restart();
    }
    return enter(Phase::kConfiguring, now);
  }
  if (!all) return;
  for (Node& node : nodes_) node.was_reset = false;
  enter(Phase::kOperational, now);
}

/// One control word further whenever the valve has followed the last one. A valve in fault gets a reset edge first.
void CanopenClient::activate(Time now) noexcept {
  bool all_active = true;
  for (std::size_t j = 0; spools_seen() && j < kJoints; ++j) {
    Valve& valve = valves_[j];
    const auto state = canopen::valve_state(valve.status_word);
    const ValveWords words = valve_words(description_.valve(j).profile);
    all_active = all_active && !valve_fault(j, now);
    if (valve.seen_at == kNever || valve.sent_word == kNothingSent || !state) {
      valve.control_word = words.init;
    } else if (canopen::valve_fault(valve.status_word)) {
      // By what went out, not every SYNC: the edge would be lost between two set-points.
      const bool edge_made = (valve.sent_word & canopen::kControlReset) != 0;
      valve.left_fault = true;
      if (valve.seen_at <= valve.reset_word_at) continue;  // each word stands until the valve has answered it
      valve.reset_word_at = now;
      valve.control_word = edge_made ? words.before_reset : words.reset;
    } else {
      switch (*state) {
        case canopen::ValveState::kInit:
          // After a fault's reset all begins anew.
          valve.control_word = valve.left_fault && valve.sent_word != words.init ? words.init : words.disabled;
          valve.left_fault = valve.left_fault && valve.sent_word != words.init;
          break;
        case canopen::ValveState::kDisabled:
          valve.control_word = words.hold;
          break;
        case canopen::ValveState::kHold:
        case canopen::ValveState::kActive:
          valve.control_word = words.active;
          break;
      }
    }
  }
  if (all_active && (!description_.has_enable() || inputs_seen_at_ != kNever)) {
    for (Node& node : nodes_) {
      node.errors.restart();
      node.emergency = canopen::kEmcyReset;  // what comes from here on counts beside the answer
    }
    enter(Phase::kChecking, now);
    return check_errors(now);
  }
  if (to_seconds(now - phase_since_) <= description_.activate_timeout_s) return;
  fail(supervise(now));  // which names what is not well, or the enable node that was never heard
}

}  // namespace knuckle::slave
