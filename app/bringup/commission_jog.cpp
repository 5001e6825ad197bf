#include "app/bringup/commission_jog.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "app/bringup/commission_dialogue.h"
#include "core/units.h"
#include "machine/kinematics.h"
#include "machine/reason_text.h"
#include "machine/toml_reader.h"
#include "slave/orderly_stop.h"

namespace knuckle::bringup {

namespace {

using slave::Jog;

constexpr Duration kStartPatience = 10s, kSdoPatience = 3s, kRestorePatience = 100ms;

/// How long a node waits for the controller's heartbeat. It may refuse.
slave::SdoScript consumer_heartbeat(const BusDescription& bus, double time_s) {
  const auto ms = static_cast<std::uint32_t>(std::lround(1e3 * time_s));
  const slave::SdoStep step{canopen::kConsumerHeartbeat, std::uint32_t{bus.controller_id} << 16 | ms};
  return {{slave::SetupPart::Kind::kOptional, {step}, {step}}};
}

slave::GuardSeen others_first() {
  slave::GuardSeen seen;
  seen.by_heartbeat = true;
  seen.tried = slave::GuardSeen::Tried::kOthersFirst;
  return seen;
}

}  // namespace

std::string jog_text(const Reason& reason, const BusDescription& bus) {
  const auto joint = [](int of) { return std::string(axis_name(of % kJoints)); };
  const std::string value = number_text(std::round(double(reason.value))), limit = number_text(double(reason.limit));
  switch (reason.code) {
    case ReasonCode::kOperatorStop:
      return "stopped from the keyboard";
    case ReasonCode::kEmergencyStop:
      return "the E-stop chain is open: release the E-stop on the machine";
    case ReasonCode::kSensorInvalid:
      return subject_text(reason, bus) + " reports an impossible value: check its sensor and wiring";
    case ReasonCode::kValveNotFollowing: {
      const Reason valve{ReasonCode::kSensorInvalid, subject_of(NodeRole::kValve, reason.subject, bus), 0, 0};
      return subject_text(valve, bus) +
             fmt::format(
                 ": its spool does not follow its command ({:.0f} % of stroke apart, limit {:.0f} %): check the "
                 "valve and its plug",
                 100 * double(reason.value), 100 * double(reason.limit));
    }
    case ReasonCode::kPilotOff:
      return !bus.has_enable() ? "the machine reports no pilot pressure: check its safety lever"
                               : "no pilot pressure: check the enable node's output and the enable valve";
    case ReasonCode::kJogOtherMoves:
      return "the " + joint(reason.subject) + " cylinder moved by " + value + " mm without a command, limit " + limit +
             " mm: valves, hoses or encoders are exchanged, or a load holding valve leaks";
    case ReasonCode::kPressureLimit:
      return joint(reason.subject / 2) + (reason.subject % 2 == 0 ? " head" : " rod") + " side pressure " + value +
             " bar, limit " + limit + " bar (chamber_pressure_bar): check the load and the relief valves";
    default:
      return text(reason, bus);
  }
}

std::string take_out_of_service(const MachineDescription& machine, BusAccess& access, bool has_address) {
  slave::OrderlyStop stop(machine, access.bus());
  while (!stop.done()) {
    stop.step(access.now(), has_address);
    access.wait_until(access.now() + from_seconds(1 / machine.bus.sync_Hz));
  }
  const auto valves = stop.unconfirmed_valves();
  const bool confirmed = std::none_of(valves.begin(), valves.end(), [](bool open) { return open; });
  return confirmed && !stop.unconfirmed_pilot()
             ? machine.bus.by_frames() ? "Out of service: all commands neutral."
                                       : "Out of service: valves disabled, pilot pressure off."
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
  const std::string details = text(client().setup_failure(), client().bus());
  throw CommissionEnded(details.empty() ? jog_text(jog_.trouble(), client().bus()) : details);
}

void JogBench::idle(Duration time) {
  for (const Time end = access_.now() + time; access_.now() < end;) idle();
}

void JogBench::check_values() const {
  if (const Reason why = jog_.invalid()) throw CommissionEnded(jog_text(why, client().bus()));
}

void JogBench::go_on() {
  if (stopped_()) jog_.stop();
  idle();
}

void JogBench::start() {
  jog_.start();
  for (const Time end = access_.now() + kStartPatience; !client().operational() || !may_command(); idle()) {
    if (access_.now() < end) continue;
    throw CommissionEnded(client().operational()
                              ? "the J1939 address is not held after 10 s: run knuckle doctor --can"
                              : "not all nodes are operational after 10 s: run knuckle doctor --can");
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
        axis_name(j), 1e3 * crept[j], 1e3 * kCreep_m));
  }
}

void JogBench::follow(JogRun& run) {
  while (jog_.phase() != Jog::Phase::kRest) {
    go_on();
    if (jog_.sample()) run.samples.push_back(*jog_.sample());
  }
  run.end = jog_.end();
}

JogRun JogBench::run(const slave::JogPlan& plan) {
  JogRun made{slave::JogEnd::kTime, plan, {}};
  jog_.move(plan);
  follow(made);
  return made;
}

std::vector<std::uint8_t> JogBench::others_waiting(const BusDescription& bus, const NodeDescription& node) const {
  std::vector<std::uint8_t> others;
  if (client().guarded_by(node.id) != slave::CanopenClient::Withheld::kHeartbeat) return others;
  for (const NodeDescription& other : bus.nodes)
    if (other.id != node.id && client().waits_for_heartbeat(other.id)) others.push_back(other.id);
  return others;
}

/// Others must not act on the missing heartbeat first: they wait for longer, until start() sets their time again.
bool JogBench::alone(const BusDescription& bus, const NodeDescription& node, bool in_motion,
                     const std::function<void()>& task) {
  const std::vector<std::uint8_t> others = others_waiting(bus, node);
  try {
    const double longer_s = to_seconds(jog_.guard_patience(in_motion) + 1s);
    for (const std::uint8_t other : others) {
      write_objects(other, consumer_heartbeat(bus, longer_s));
      if (!jog_.dialogue()->took(canopen::kConsumerHeartbeat)) return false;
    }
    task();
  } catch (...) {
    for (const std::uint8_t other : others) restore(other, consumer_heartbeat(bus, bus.controller_timeout_s));
    throw;
  }
  return true;
}

slave::GuardSeen JogBench::try_guard(const BusDescription& bus, const NodeDescription& node, int joint) {
  slave::GuardSeen seen = others_first();
  const bool tried = alone(bus, node, false, [&] {
    jog_.try_guard(node, joint);
    while (jog_.phase() != Jog::Phase::kRest) go_on();
  });
  if (tried) seen = jog_.guard_seen();
  start();
  return seen;
}

OutputsTried JogBench::try_outputs(const BusDescription& bus, const NodeDescription& module,
                                   const slave::JogPlan& plan) {
  OutputsTried made{others_first(), {slave::JogEnd::kTime, plan, {}}};
  const bool tried = alone(bus, module, true, [&] {
    jog_.try_outputs(module, plan);
    follow(made.run);
  });
  if (tried) made.seen = jog_.guard_seen();
  start();
  return made;
}

std::vector<std::string> JogBench::emergencies(const std::function<bool(const slave::EmergencyRecord&)>& expected) {
  const slave::EmergencyLog& log = client().emergencies();
  std::vector<std::string> told;
  for (auto age = static_cast<std::size_t>(std::min<std::uint64_t>(log.count() - emergencies_told_, log.kept()));
       age-- > 0;) {
    const slave::EmergencyRecord& record = log.newest(age);
    if (record.emergency.code == canopen::kEmcyReset || (expected && expected(record))) continue;
    const std::string text = slave::text(record, client().bus());
    if (std::find(told.begin(), told.end(), text) == told.end()) told.push_back(text);
  }
  emergencies_told_ = log.count();
  return told;
}

/// Whatever is wrong meanwhile, and not for long.
void JogBench::restore(std::uint8_t node, slave::SdoScript script) noexcept {
  jog_.write_objects(node, std::move(script));
  for (const Time end = access_.now() + kRestorePatience;
       access_.now() < end && !jog_.dialogue()->done() && !jog_.dialogue()->failure();)
    step();
}

void JogBench::write_objects(std::uint8_t node, slave::SdoScript script) {
  jog_.write_objects(node, std::move(script));
  const auto& dialogue = jog_.dialogue();
  for (const Time end = access_.now() + kSdoPatience; !dialogue->done() && !dialogue->failure(); idle()) {
    if (access_.now() >= end) break;
  }
  if (dialogue->done()) return;
  const std::string why = text(dialogue->details(), client().bus());
  throw CommissionEnded(why.empty() ? node_text(node, client().bus()) + " did not answer within 3 s" : why);
}

namespace {

using Level = Finding::Level;

constexpr double kMoved_m = 2e-3;
constexpr double kDecisive_Pa =
    20e5;  // the pressure of a chamber that drives its cylinder against a stop rises by more
// Pins beside their nominal place, by more on a larger machine; cushions not passed.
constexpr double kStrokeTolerance_m = 8e-3, kStrokeTolerance = 0.015;
constexpr double kLastOfRun_s = 0.2, kBeforeRun_s = 0.1;
constexpr double kFirstWay_m = 4e-4, kLastWay_m = 4e-3;  // part of the ramp's motion that the line is fitted to

std::array<double, 6> mean_pressure(const JogRun& run, double from_s, double to_s) {
  std::array<double, 6> mean{};
  double count = 0;
  for (const slave::JogSample& s : run.samples) {
    if (s.t_s < from_s || s.t_s > to_s) continue;
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += s.pressure_Pa[i];
    ++count;
  }
  for (double& value : mean) value /= std::max(count, 1.0);
  return mean;
}

/// What to change where its measured length counts the other way.
std::string sign_text(int joint, const BusDescription& bus) {
  const BroadcastField* const sent = bus.broadcast(NodeRole::kEncoder, joint).field;
  if (sent == nullptr)
    return bus.measures_angle(joint)
               ? "change its direction (0x6000) with the manufacturer's tool, or 'sign' of its node "
                 "in the machine file"
               : "change its direction (0x6000) with the manufacturer's tool";
  if (sent->analog)
    return fmt::format("exchange 'low' and 'high' of {} in the machine file ([bus.node.inputs])", sent->info().name);
  if (sent->info().is_angle)
    return fmt::format("change 'sign' of {} in the machine file ([bus.broadcast.signals])", sent->info().name);
  return fmt::format("change the signs of 'scale' and 'offset' of {} in the machine file ([bus.broadcast.signals])",
                     sent->info().name);
}

}  // namespace

Finding judge_direction(const JogRun& run, Seen seen, const BusDescription& bus) {
  const int joint = run.plan.joint;
  const bool extends = run.plan.peak > 0;
  const std::string about = axis_name(joint);
  const double way_mm = 1e3 * run.travelled_m()[joint];
  const auto fault = [&](const std::string& text) { return Finding{Level::kFault, about, text}; };
  if (seen == Seen::kAnother) return fault("its valve moves another cylinder: exchange the valves' plugs or node ids");
  const bool counted = std::abs(way_mm) > 1e3 * kMoved_m;
  if (seen == Seen::kStill && counted) {
    return fault(
        fmt::format("its encoder measured {:.1f} mm, but its cylinder stands still: encoders are exchanged", way_mm));
  }
  if (seen == Seen::kStill) {
    return fault(fmt::format(
        "did not move at a command of {:.2f} of stroke: check pilot pressure, the valve's plug and its dead band",
        std::abs(run.samples.back().command)));
  }
  if (!counted) return fault("moved, but its encoder measured no motion: check the encoder, its wire and its node id");
  const bool longer = seen == Seen::kLonger;
  if (longer != extends && (way_mm > 0) == extends) {
    return fault(fmt::format(
        "was to {}, its encoder measured {:+.1f} mm, and you saw the opposite: if you saw right, exchange the valve's "
        "hoses A and B and change the encoder's direction; else begin anew",
        extends ? "extend" : "retract", way_mm));
  }
  if (longer != extends) {
    return fault(
        "moves in the wrong direction: exchange the valve's hoses A and B, or change the sign in the valve's set-up");
  }
  if ((way_mm > 0) != longer) {
    return fault("its encoder counts in the wrong direction: " + sign_text(joint, bus));
  }
  return {Level::kOk, about,
          fmt::format("{}: encoder {:+.1f} mm, as commanded", extends ? "extends" : "retracts", way_mm)};
}

Finding judge_tilt(double reading_rad, double level_rad) {
  constexpr double kMost_rad = 1 * kDegree;
  const bool off = std::abs(reading_rad - level_rad) > kMost_rad;
  const bool sign = off && std::abs(reading_rad + level_rad) <= kMost_rad;
  return {off ? Level::kFault : Level::kOk, "tilt",
          fmt::format("sensor {:.2f} deg, spirit level {:.2f} deg", reading_rad / kDegree, level_rad / kDegree) +
              (sign  ? ": the sensor's sign is reversed: turn it round or change its direction"
               : off ? ", limit of the difference 1 deg: zero the sensor as its manual says, or mount it level"
                     : "")};
}

std::optional<StrokeEnd> stroke_end(const JogRun& run) {
  if (run.end != slave::JogEnd::kStalled) return std::nullopt;
  const double last_s = run.samples.back().t_s;
  StrokeEnd end{run.samples.back().length_m[run.plan.joint], mean_pressure(run, last_s - kLastOfRun_s, last_s)};
  const auto before = mean_pressure(run, 0, kBeforeRun_s);
  for (std::size_t i = 0; i < before.size(); ++i) end.rise_Pa[i] -= before[i];
  return end;
}

Finding judge_sides(const StrokeEnd& end, int joint, bool extended) {
  const std::size_t driven = 2 * static_cast<std::size_t>(joint) + (extended ? 0 : 1);
  const auto highest = std::max_element(end.rise_Pa.begin(), end.rise_Pa.end());
  const auto which = static_cast<std::size_t>(highest - end.rise_Pa.begin());
  const char* side = extended ? "head" : "rod";
  const std::string about = axis_name(joint);
  if (*highest < kDecisive_Pa) {
    return {Level::kNote, about,
            fmt::format(
                "{} side not checked: no chamber pressure rises by {:.0f} bar at the stop (highest rise {:.0f} bar)",
                side, kDecisive_Pa / 1e5, *highest / 1e5)};
  }
  if (which == driven) {
    return {Level::kOk, about,
            fmt::format("{} side pressure rises by {:.0f} bar at the stop, as expected", side, *highest / 1e5)};
  }
  return {Level::kFault, about,
          fmt::format(
              "at the stop the pressure of {} {} rises by {:.0f} bar instead of that of {} {}: exchange the plugs or "
              "node ids "
              "of the two transmitters",
              axis_name(static_cast<int>(which / 2)), which % 2 == 0 ? "head" : "rod", *highest / 1e5, axis_name(joint),
              side)};
}

const char* step_key(const MachineDescription& machine, int joint) noexcept {
  if (const BroadcastField* const sent = machine.bus.broadcast(NodeRole::kEncoder, joint).field)
    return sent->analog ? "low and high of its input" : "scale of its signal";
  return machine.bus.encoder(joint).measures_angle() ? "steps_per_turn" : "encoder_step_mm";
}

Finding judge_stroke(double stroke_m, int joint, const MachineDescription& machine) {
  const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(joint)];
  const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
  const Kinematics kinematics(machine);
  const double most_m = cylinder.max_length_m - cylinder.min_length_m;
  const double least_m = std::abs(kinematics.cylinder_at(joint, link.max_rad).value().length_m -
                                  kinematics.cylinder_at(joint, link.min_rad).value().length_m);
  const double tolerance_m = std::max(kStrokeTolerance_m, kStrokeTolerance * most_m);
  const bool good = stroke_m >= least_m - tolerance_m && stroke_m <= most_m + tolerance_m;
  const std::string range =
      fmt::format("{:.1f} mm measured between its stops, expected {:.1f} mm (joint range) to {:.1f} mm (cylinder)",
                  1e3 * stroke_m, 1e3 * least_m, 1e3 * most_m);
  if (good) return {Level::kOk, axis_name(joint), range};
  return {Level::kFault, axis_name(joint),
          range + fmt::format(": check {}, min_length_m, max_length_m, and that it reached both stops",
                              step_key(machine, joint))};
}

std::optional<double> dead_band(const JogRun& ramp, const ValveDescription& valve) {
  const int joint = ramp.plan.joint;
  const double start_m = ramp.samples.front().length_m[joint];
  double n = 0, sum_t = 0, sum_r = 0, sum_tt = 0, sum_tr = 0;
  for (const slave::JogSample& s : ramp.samples) {
    const double way_m = std::abs(s.length_m[joint] - start_m);
    if (way_m < kFirstWay_m || way_m > kLastWay_m) continue;
    const double root = std::sqrt(way_m);
    ++n;
    sum_t += s.t_s;
    sum_r += root;
    sum_tt += s.t_s * s.t_s;
    sum_tr += s.t_s * root;
  }
  const double spread = n * sum_tt - sum_t * sum_t;
  constexpr double kFewest = 10;
  if (n < kFewest || spread <= 0) return std::nullopt;
  const double slope = (n * sum_tr - sum_t * sum_r) / spread;
  if (slope <= 0) return std::nullopt;
  const double edge_s = (sum_t - sum_r / slope) / n;
  const double lag_s = valve.delay_s + 2 * valve.damping_ratio / (2 * std::numbers::pi * valve.natural_frequency_Hz);
  return ramp.plan.rise_1ps * (edge_s - lag_s);
}

bool dead_band_differs(double found, double file) noexcept {
  constexpr double kRampError = 0.03;
  return std::abs(found - file) > kRampError;
}

Finding judge_dead_band(const std::optional<double>& found, double file, int joint, int direction) {
  const char* const way = direction > 0 ? "extend" : "retract";
  if (!found)
    return {Level::kNote, axis_name(joint),
            fmt::format("dead band to {} not found: the cylinder did not move evenly during the ramp", way)};
  const bool off = dead_band_differs(*found, file);
  return {off ? Level::kNote : Level::kOk, axis_name(joint),
          fmt::format("dead band to {}: measured {:.1f} % of stroke, machine file {:.1f} %", way, 100 * *found,
                      100 * file) +
              (off ? fmt::format("; the measured value is written as dead_band_{}", way) : std::string())};
}

}  // namespace knuckle::bringup
