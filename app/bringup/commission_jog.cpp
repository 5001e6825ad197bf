#include "app/bringup/commission_jog.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "app/bringup/commission_dialogue.h"
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

}  // namespace

std::string jog_text(const Reason& reason, const BusDescription& bus) {
  const auto joint = [](int of) { return std::string(kJointNames[static_cast<std::size_t>(of % kJoints)]); };
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

std::string take_out_of_service(const MachineDescription& machine, BusAccess& access) {
  slave::OrderlyStop stop(machine, access.bus());
  while (!stop.done()) {
    stop.step(access.now());
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

slave::GuardSeen JogBench::try_guard(const BusDescription& bus, const NodeDescription& node, int joint) {
  const bool by_heartbeat = client().guarded_by(node.id) == slave::CanopenClient::Withheld::kHeartbeat;
  bool others_first = false;
  try {
    // Others must not act on the missing heartbeat first: they wait for longer, until start() sets their time again.
    const double longer_s = to_seconds(jog_.guard_patience() + 1s);
    for (const NodeDescription& other : bus.nodes) {
      if (!by_heartbeat || other.id == node.id || !client().waits_for_heartbeat(other.id)) continue;
      write_objects(other.id, consumer_heartbeat(bus, longer_s));
      others_first = others_first || !jog_.dialogue()->took(canopen::kConsumerHeartbeat);
    }
    if (!others_first) jog_.try_guard(node, joint);
    while (jog_.phase() != Jog::Phase::kRest) go_on();
  } catch (...) {
    for (const NodeDescription& other : bus.nodes) {
      if (by_heartbeat && other.id != node.id && client().waits_for_heartbeat(other.id))
        restore(other.id, consumer_heartbeat(bus, bus.controller_timeout_s));
    }
    throw;
  }
  slave::GuardSeen seen = jog_.guard_seen();
  if (others_first) {
    seen = {};
    seen.by_heartbeat = true;
    seen.tried = slave::GuardSeen::Tried::kOthersFirst;
  }
  start();
  return seen;
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

constexpr double kStopping_s = 0.3;  // a spool closes, and that is told: by SDO where it sends nothing by itself
constexpr double kMoved_m = 2e-3;
constexpr double kDecisive_Pa =
    20e5;  // the pressure of a chamber that drives its cylinder against a stop rises by more
// Pins beside their nominal place, by more on a larger machine; cushions not passed.
constexpr double kStrokeTolerance_m = 8e-3, kStrokeTolerance = 0.015;
constexpr double kLastOfRun_s = 0.2, kBeforeRun_s = 0.1;
constexpr double kFirstWay_m = 4e-4, kLastWay_m = 4e-3;  // part of the ramp's motion that the line is fitted to

const char* axis(int joint) noexcept {
  return kJointNames[static_cast<std::size_t>(joint)];
}

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

}  // namespace

GuardJudged judge_guard(const NodeDescription& node, const slave::GuardSeen& seen) {
  const auto ms = [](double s) { return fmt::format("{:.0f} ms", 1e3 * s); };
  const bool valve = node.role == NodeRole::kValve;
  const std::string without = seen.by_heartbeat ? "without a heartbeat " : "without set-points ";
  const std::string how = seen.asked ? " (asked by SDO: it sends no process data then)" : "";
  const std::string told = !seen.told_s ? std::string("told nothing")
                           : seen.emergency != 0
                               ? fmt::format("told error 0x{:04X} after ", seen.emergency) + ms(*seen.told_s)
                               : "no longer works, after " + ms(*seen.told_s);
  using Tried = slave::GuardSeen::Tried;
  const auto because = [&](const std::string& text, bool dead = false) {
    // Without a guard nothing stops it when this computer is gone.
    const Level level = dead && node.unguarded.empty() ? Level::kFault : Level::kNote;
    return GuardJudged{false, {level, node.name, "guard not proved: " + text}};
  };
  const auto proved = [&](const std::string& text) {
    return GuardJudged{true, {Level::kOk, node.name, "guard proved: " + text}};
  };
  if (seen.tried == Tried::kNoDeadBand) return because("the file's dead band is too small to open it inside that");
  if (seen.crept_m)
    return because(fmt::format("its cylinder moved by {:.1f} mm at an opening inside the file's dead band: correct "
                               "dead_band_extend and dead_band_retract",
                               1e3 * *seen.crept_m),
                   true);
  if (seen.tried == Tried::kDidNotFollow)
    return because("its spool does not follow a small command inside the dead band: check the valve and its plug");
  if (seen.tried == Tried::kOthersFirst)
    return because(
        "not tried: another node lets nobody change how long it waits for the heartbeat, and would act first");
  const std::string guard_time = " (" + ms(seen.guard_s) + ")";
  if (seen.early)
    return because((seen.told_s ? "it " + told : "it stopped after " + ms(*seen.stopped_s)) +
                   ", before its guard could act" + guard_time + ": find out why, and commission again");
  if (seen.silent)
    return because("it " + told + ", and says no more " +
                   (valve ? "where its spool is" : "whether pilot pressure is on"));
  if (!valve && !seen.stopped_s) return because("pilot pressure stayed on without the controller's heartbeat", true);
  if (!valve && seen.others_stopped) return because("pilot pressure went off after a valve had stopped");
  if (seen.stopped_s && *seen.stopped_s > seen.guard_s + kStopping_s)
    return because(without + "it stopped only after " + ms(*seen.stopped_s) + ": its guard's time" + guard_time +
                   " is not kept");
  if (!valve) return proved(without + "pilot pressure was off after " + ms(*seen.stopped_s) + how);
  if (seen.pilot_off_s) {
    return because(told + ", but pilot pressure went off after " + ms(*seen.pilot_off_s) +
                   ", before its spool was surely back: the enable node must leave a valve time to close by itself");
  }
  if (!seen.stopped_s) return because(without + "it " + told + ", and its spool stayed open", true);
  if (!seen.told_s) return because("its spool was back after " + ms(*seen.stopped_s) + ", but it told nothing");
  return proved(without + "it " + told + ", spool back after " + ms(*seen.stopped_s) + how +
                (seen.other_guard ? "; that it also stops without a heartbeat was not tried" : ""));
}

/// It has stopped when it is where it stands in the end, but for its swinging on the oil.
GuardJudged judge_silence(const JogRun& run, const BusDescription& bus) {
  constexpr double kSwing_m = 3e-3, kFinest_m = 1e-3, kSwing_s = 0.1, kEnd_s = 0.3, kStands_s = 0.6, kBefore_s = 0.2,
                   kSlowest_mps = 5e-3;
  const int joint = run.plan.joint;
  const std::string what = fmt::format("{}, when command frames end", axis(joint));
  double before_m = 0, led_m = 0, led_s = 0, stands_m = 0, count = 0, stopped_s = 0;
  for (const slave::JogSample& s : run.samples)
    if (!s.silent) led_s = s.t_s;
  for (const slave::JogSample& s : run.samples) {
    const double length_m = s.length_m[joint];
    if (!s.silent && s.t_s <= led_s - kBefore_s) before_m = length_m;
    if (!s.silent) led_m = length_m;
    if (!s.silent || s.t_s < run.samples.back().t_s - kEnd_s) continue;
    stands_m += length_m;
    ++count;
  }
  stands_m /= std::max(count, 1.0);
  if (run.end != slave::JogEnd::kTravelled || led_m - before_m < kSlowest_mps * kBefore_s)
    return {false, {Level::kNote, what, "not proved: its cylinder did not move far or fast enough before"}};
  // A slow cylinder swings less, and says less of when it has stopped.
  const double swing_m = std::clamp(kSwing_s / kBefore_s * (led_m - before_m), kFinest_m, kSwing_m);
  for (const slave::JogSample& s : run.samples)
    if (s.silent && std::abs(s.length_m[joint] - stands_m) > swing_m) stopped_s = s.t_s;
  if (stopped_s > run.samples.back().t_s - kStands_s)
    return {false,
            {Level::kFault, what, "its cylinder goes on moving: the machine's own controller must end all motion"}};
  const std::string stands = fmt::format("its cylinder stands after {:.0f} ms", 1e3 * stopped_s);
  if (stopped_s <= bus.valve_watchdog_s + kStopping_s) return {true, {Level::kOk, what, stands}};
  return {false,
          {Level::kFault, what,
           stands + fmt::format(", which is late: valve_watchdog_ms = {:.0f}, and {:.0f} ms to stop",
                                1e3 * bus.valve_watchdog_s, 1e3 * kStopping_s)}};
}

Finding judge_direction(const JogRun& run, Seen seen) {
  const int joint = run.plan.joint;
  const bool extends = run.plan.peak > 0;
  const std::string about = axis(joint);
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
    return fault(
        "its encoder counts in the wrong direction: change it (0x6000) with the manufacturer's tool, or the 'sign' of "
        "a rotary encoder in the machine file");
  }
  return {Level::kOk, about,
          fmt::format("{}: encoder {:+.1f} mm, as commanded", extends ? "extends" : "retracts", way_mm)};
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
  const std::string about = axis(joint);
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
              axis(static_cast<int>(which / 2)), which % 2 == 0 ? "head" : "rod", *highest / 1e5, axis(joint), side)};
}

const char* step_key(const MachineDescription& machine, int joint) noexcept {
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
  if (good) return {Level::kOk, axis(joint), range};
  return {Level::kFault, axis(joint),
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

}  // namespace knuckle::bringup
