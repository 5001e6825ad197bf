#include "app/bringup/commission_guards.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "machine/bus_description.h"
#include "machine/reason_text.h"
#include "slave/emergency_log.h"
#include "slave/safety_gate.h"
#include "transport/canopen.h"

namespace knuckle::bringup {
namespace {

using Level = Finding::Level;
using Tried = slave::GuardSeen::Tried;

constexpr double kStopping_s = 0.3;  // a spool closes, and that is told: by SDO where it sends nothing by itself
constexpr double kWay_m = 0.015, kLongest_s = 10;
constexpr const char* kOthersFirst =
    "not tried: another node lets nobody change how long it waits for the heartbeat, and would act first";
constexpr const char* kHeartbeatUntried = "; that it also stops without a heartbeat was not tried";

std::string ms(double s) {
  return fmt::format("{:.0f} ms", 1e3 * s);
}

std::string told_text(const slave::GuardSeen& seen) {
  if (!seen.told_s) return "told nothing";
  if (seen.emergency == 0) return "no longer works, after " + ms(*seen.told_s);
  return fmt::format("told error 0x{:04X} after ", seen.emergency) + ms(*seen.told_s);
}

GuardJudged not_proved(const NodeDescription& node, const std::string& about, const std::string& text, bool dead) {
  // Without a guard nothing stops it when this computer is gone.
  return {false, {dead && node.unguarded.empty() ? Level::kFault : Level::kNote, about, "guard not proved: " + text}};
}

/// Of CiA 301: what is withheld from nodes makes them tell it.
bool is_communication_error(std::uint16_t code) noexcept {
  return code >= 0x8100 && code <= 0x82FF;
}

/// Of a cylinder that was led until nobody told its valve anything.
struct Standing {
  bool was_fast = false, goes_on = false;
  double after_s = 0;
};

/// It has stopped when it is where it stands in the end, but for its swinging on the oil.
Standing standing(const JogRun& run) {
  constexpr double kSwing_m = 3e-3, kFinest_m = 1e-3, kSwing_s = 0.1, kEnd_s = 0.3, kStands_s = 0.6, kBefore_s = 0.2,
                   kSlowest_mps = 5e-3;
  const int joint = run.plan.joint;
  double before_m = 0, led_m = 0, led_s = 0, stands_m = 0, count = 0;
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
  Standing seen;
  seen.was_fast = run.end == slave::JogEnd::kTravelled && led_m - before_m >= kSlowest_mps * kBefore_s;
  // A slow cylinder swings less, and says less of when it has stopped.
  const double swing_m = std::clamp(kSwing_s / kBefore_s * (led_m - before_m), kFinest_m, kSwing_m);
  for (const slave::JogSample& s : run.samples)
    if (s.silent && std::abs(s.length_m[joint] - stands_m) > swing_m) seen.after_s = s.t_s;
  seen.goes_on = !run.samples.empty() && seen.after_s > run.samples.back().t_s - kStands_s;
  return seen;
}

constexpr const char* kTooSlow = "its cylinder did not move far or fast enough before";

}  // namespace

GuardJudged judge_guard(const NodeDescription& node, const slave::GuardSeen& seen) {
  const bool valve = node.role == NodeRole::kValve;
  const std::string without = seen.by_heartbeat ? "without a heartbeat " : "without set-points ";
  const std::string how = seen.asked ? " (asked by SDO: it sends no process data then)" : "";
  const std::string told = told_text(seen);
  const auto because = [&](const std::string& text, bool dead = false) {
    return not_proved(node, node.name, text, dead);
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
  if (seen.tried == Tried::kOthersFirst) return because(kOthersFirst);
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
                (seen.other_guard ? kHeartbeatUntried : ""));
}

GuardJudged judge_silence(const JogRun& run, const BusDescription& bus) {
  const std::string what = fmt::format("{}, when command frames end", axis_name(run.plan.joint));
  const Standing seen = standing(run);
  if (!seen.was_fast) return {false, {Level::kNote, what, std::string("not proved: ") + kTooSlow}};
  if (seen.goes_on)
    return {false,
            {Level::kFault, what, "its cylinder goes on moving: the machine's own controller must end all motion"}};
  const std::string stands = "its cylinder stands after " + ms(seen.after_s);
  if (seen.after_s <= bus.valve_watchdog_s + kStopping_s) return {true, {Level::kOk, what, stands}};
  return {false,
          {Level::kFault, what,
           stands + fmt::format(", which is late: valve_watchdog_ms = {:.0f}, and {:.0f} ms to stop",
                                1e3 * bus.valve_watchdog_s, 1e3 * kStopping_s)}};
}

GuardJudged judge_outputs(const NodeDescription& module, const OutputsTried& tried) {
  const slave::GuardSeen& seen = tried.seen;
  const std::string about = module.name + ", " + axis_name(tried.run.plan.joint);
  const std::string without = seen.by_heartbeat ? "without a heartbeat " : "without set-points ";
  const auto because = [&](const std::string& text, bool dead = false) {
    return not_proved(module, about, text, dead);
  };
  if (seen.tried == Tried::kOthersFirst) return because(kOthersFirst);
  const Standing stands = standing(tried.run);
  if (!stands.was_fast) return because(kTooSlow);
  if (seen.silent) return because("it " + told_text(seen) + ", and says no more how long its cylinders are");
  if (stands.goes_on)
    return because(without + "it " + told_text(seen) +
                       ", and its cylinder goes on moving: its outputs must take their error values by themselves",
                   true);
  const std::string after = "its cylinder stands after " + ms(stands.after_s);
  if (seen.early)
    return because("it " + told_text(seen) + ", before its guard could act (" + ms(seen.guard_s) +
                   "): find out why, and commission again");
  if (seen.pilot_off_s && *seen.pilot_off_s <= stands.after_s)
    return because(after + ", but pilot pressure went off after " + ms(*seen.pilot_off_s) + ", which may be why");
  if (stands.after_s > seen.guard_s + kStopping_s)
    return because(without + after + ", which is late: its guard's time is " + ms(seen.guard_s) + ", and " +
                       ms(kStopping_s) + " to stop",
                   true);
  return {true,
          {Level::kOk, about,
           "guard proved: " + without + "it " + told_text(seen) + ", " + after +
               (seen.asked ? " (asked by SDO: it sends no inputs then)" : "") +
               (seen.other_guard ? kHeartbeatUntried : "")}};
}

std::string GuardTrials::motions_text(const BusDescription& bus) {
  const bool own = moves_joints(bus, kOwnController);
  const bool modules = std::any_of(bus.nodes.begin(), bus.nodes.end(),
                                   [&](const NodeDescription& node) { return moves_joints(bus, node.id); });
  std::string text = fmt::format("Each cylinder extends once more by about {:.0f} mm; then ", 1e3 * kWay_m);
  if (own) text += "no more commands are sent, and the machine's own controller must stop it.";
  if (modules)
    text += std::string(own ? " Then a module hears nothing more of what it waits for: it must stop its cylinder."
                            : "its module hears nothing more of what it waits for, and must stop it.") +
            " An error value that is not neutral moves a cylinder at full speed: a hand on the E-stop.";
  return text;
}

void GuardTrials::note(GuardResult& result, const GuardJudged& judged, const std::string& about) {
  result.proved = result.proved && judged.proved;
  result.seen += (result.seen.empty() ? "" : "; ") + about + judged.finding.text;
  keep_(judged.finding);
}

/// But for what the trial makes nodes tell.
void GuardTrials::tell_emergencies(const NodeDescription& node, const slave::GuardSeen& seen) {
  const auto expected = [&](const slave::EmergencyRecord& record) {
    const std::uint16_t code = record.emergency.code;
    return is_communication_error(code) || (record.node == node.id && code == seen.emergency);
  };
  for (const std::string& text : bench_.emergencies(expected)) keep_({Level::kNote, "emergency", text});
}

GuardResult GuardTrials::result_of(const NodeDescription& node) const {
  const auto serial = serials_.find(node.id);
  return {node.name,
          node.vendor,
          node.product,
          serial == serials_.end() ? std::nullopt : std::optional(serial->second),
          true,
          "",
          told_channels_text(node, bus_)};
}

void GuardTrials::at_rest(const NodeDescription& node, GuardResult& result) {
  for (const NodeChannel& channel : node.channels) {
    const slave::GuardSeen seen = bench_.try_guard(bus_, node, channel.info().index);
    GuardJudged judged = judge_guard(node, seen);
    if (node.channels.size() > 1) judged.finding.about += std::string(", ") + channel.info().name;
    note(result, judged);
    tell_emergencies(node, seen);
  }
}

void GuardTrials::nodes(std::vector<GuardResult>& results) {
  for (const NodeDescription& node : bus_.nodes)
    if (node.is_told() && node.role != NodeRole::kModule) at_rest(node, results.emplace_back(result_of(node)));
}

void GuardTrials::own_controller(GuardResult& result) {
  for (int joint = 0; joint < kJoints; ++joint) {
    if (!moves_joint(bus_, kOwnController, joint)) continue;
    const GuardJudged judged = judge_silence(bench_.run({.joint = joint,
                                                         .peak = slave::kJogTable.command,
                                                         .travel_m = kWay_m,
                                                         .longest_s = kLongest_s,
                                                         .then_silence = true}),
                                             bus_);
    note(result, judged, judged.finding.about + ": ");
  }
}

void GuardTrials::outputs_of(const NodeDescription& module, GuardResult& result) {
  for (int joint = 0; joint < kJoints; ++joint) {
    if (!moves_joint(bus_, module.id, joint)) continue;
    const OutputsTried tried = bench_.try_outputs(
        bus_, module, {.joint = joint, .peak = slave::kJogTable.command, .travel_m = kWay_m, .longest_s = kLongest_s});
    const GuardJudged judged = judge_outputs(module, tried);
    note(result, judged, judged.finding.about + ": ");
    tell_emergencies(module, tried.seen);
  }
}

void GuardTrials::in_motion(std::vector<GuardResult>& results) {
  if (moves_joints(bus_, kOwnController)) {
    results.emplace_back().proved = true;
    own_controller(results.back());
  }
  for (const NodeDescription& node : bus_.nodes)
    if (moves_joints(bus_, node.id)) outputs_of(node, results.emplace_back(result_of(node)));
  nodes(results);
}

}  // namespace knuckle::bringup
