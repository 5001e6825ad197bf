#include "app/bringup/commission_jog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/bringup/commission_dialogue.h"
#include "machine/toml_reader.h"
#include "slave/orderly_stop.h"

namespace knuckle::bringup {
namespace {

using slave::Jog;

constexpr Duration kStartPatience = 10s, kSdoPatience = 3s;

}  // namespace

std::string jog_text(const Reason& reason) {
  const auto joint = [](int of) { return std::string(kJointNames[static_cast<std::size_t>(of % kJoints)]); };
  const std::string value = number_text(std::round(double(reason.value))), limit = number_text(double(reason.limit));
  switch (reason.code) {
    case ReasonCode::kOperatorStop:
      return "stopped from the keyboard";
    case ReasonCode::kEmergencyStop:
      return "the E-stop chain is open: release the E-stop on the machine";
    case ReasonCode::kSensorInvalid:
      return fmt::format("node 0x{:02X} reports an invalid value: check its sensor and wiring", reason.subject);
    case ReasonCode::kPilotOff:
      return "no pilot pressure: check the enable node's output and the enable valve";
    case ReasonCode::kJogOtherMoves:
      return "the " + joint(reason.subject) + " cylinder moved by " + value + " mm without a command, limit " + limit +
             " mm: valves, hoses or encoders are exchanged, or a load holding valve leaks";
    case ReasonCode::kPressureLimit:
      return joint(reason.subject / 2) + (reason.subject % 2 == 0 ? " head" : " rod") + " side pressure " + value +
             " bar, limit " + limit + " bar (chamber_pressure_bar): check the load and the relief valves";
    default:
      return text(reason);
  }
}

std::string take_out_of_service(const MachineDescription& machine, BusAccess& access) {
  slave::OrderlyStop stop(machine, access.bus());
  while (!stop.done()) {
    stop.step(access.now());
    access.wait_until(access.now() + from_seconds(1 / machine.bus.sync_Hz));
  }
  const auto valves = stop.unconfirmed_valves();
  const bool confirmed = std::none_of(valves.begin(), valves.end(), [](bool open) { return open; });
  return confirmed && !stop.unconfirmed_pilot()
             ? "Out of service: valves disabled, pilot pressure off."
             : "Out of service, but not confirmed by all nodes: their own watchdogs stop them.";
}

JogBench::JogBench(const MachineDescription& machine, BusAccess& access, std::function<bool()> stopped)
    : access_(access),
      stopped_(std::move(stopped)),
      jog_(machine, access.bus()),
      period_(from_seconds(1 / machine.bus.sync_Hz)),
      due_(access.now()) {}

/// Missed periods are skipped: a command is never sent twice in a burst.
void JogBench::step() {
  due_ = std::max(due_ + period_, access_.now());
  access_.wait_until(due_);
  jog_.step(access_.now());
}

void JogBench::idle() {
  step();
  if (!jog_.trouble()) return;
  const std::string details = text(client().setup_failure());
  throw CommissionEnded(details.empty() ? jog_text(jog_.trouble()) : details);
}

void JogBench::idle(Duration time) {
  for (const Time end = access_.now() + time; access_.now() < end;) idle();
}

void JogBench::go_on() {
  if (stopped_()) jog_.stop();
  idle();
}

void JogBench::start() {
  jog_.start();
  for (const Time end = access_.now() + kStartPatience; !client().operational(); idle()) {
    if (access_.now() >= end)
      throw CommissionEnded("not all nodes are operational after 10 s: run knuckle doctor --can");
  }
  for (const Time end = access_.now() + Jog::kSettle; sensors().oldest() == kNever; idle()) {
    if (access_.now() >= end) throw CommissionEnded("a sensor has sent no value: find it with knuckle doctor --can");
  }
}

void JogBench::neutral() noexcept {
  jog_.stop();
  for (const Time end = access_.now() + Jog::kSettle; access_.now() < end;) step();
}

JointVector JogBench::try_pilot(Duration time) {
  const JointVector before = sensors().length_m;
  jog_.hold_pilot(time);
  while (jog_.phase() == Jog::Phase::kPilotUp || jog_.phase() == Jog::Phase::kHeld) go_on();
  const JointVector crept = sensors().length_m - before;
  while (jog_.phase() != Jog::Phase::kRest) go_on();
  return crept;
}

void JogBench::prove_closed() {
  constexpr double kCreep_m = 2e-3;
  const JointVector crept = try_pilot(2s);
  for (int j = 0; j < kJoints; ++j) {
    if (std::abs(crept[j]) <= kCreep_m) continue;
    throw CommissionEnded(fmt::format(
        "the {} cylinder moved by {:.1f} mm with closed valves, limit {:.0f} mm: check its spool's centring and "
        "its load holding valve",
        kJointNames[static_cast<std::size_t>(j)], 1e3 * crept[j], 1e3 * kCreep_m));
  }
}

JogRun JogBench::run(const slave::JogPlan& plan) {
  JogRun made{slave::JogEnd::kTime, plan, {}};
  jog_.move(plan);
  while (jog_.phase() != Jog::Phase::kRest) {
    go_on();
    if (jog_.sample()) made.samples.push_back(*jog_.sample());
  }
  made.end = jog_.end();
  return made;
}

void JogBench::write_objects(std::uint8_t node, slave::SdoScript script) {
  jog_.write_objects(node, std::move(script));
  const auto& dialogue = jog_.dialogue();
  for (const Time end = access_.now() + kSdoPatience; !dialogue->done() && !dialogue->failure(); idle()) {
    if (access_.now() >= end) break;
  }
  if (dialogue->done()) return;
  const std::string why = text(dialogue->details());
  throw CommissionEnded(why.empty() ? "an encoder did not accept its preset within 3 s" : why);
}

}  // namespace knuckle::bringup
