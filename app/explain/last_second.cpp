#include "app/explain/last_second.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "app/explain/text.h"
#include "estimation/force_estimator.h"

namespace knuckle::explain {
namespace {

constexpr Duration kSpan = 1s;
constexpr double kBar = 1e5;
using slave::SlaveState;

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

/// Of the last second that is known until the stop.
template <typename State>
std::vector<const State*> last_of(const std::vector<State>& states, const Stop& stop) {
  std::vector<const State*> last;
  for (auto at = states.rbegin(); at != states.rend(); ++at) {
    if (at->at > stop.at) continue;
    if (!last.empty() && last.front()->at - at->at > kSpan) break;
    last.push_back(&*at);
  }
  std::reverse(last.begin(), last.end());
  return last;
}

/// "enable held" or "enable not held since 12.340 s".
template <typename State>
std::string switch_text(const char* name, const std::vector<const State*>& states, bool State::*is) {
  const bool now = states.back()->*is;
  std::string text = std::string(name) + (now ? " on" : " off");
  for (auto at = states.rbegin(); at != states.rend(); ++at)
    if ((*at)->*is != now) return text + " since " + at_text((*(at - 1))->at);
  return text;
}

template <typename State>
std::string operator_text(const std::vector<const State*>& states) {
  std::string text = switch_text("enable", states, &State::enable) + ", " +
                     switch_text("hand on the device", states, &State::presence) + ", " +
                     switch_text("clutch", states, &State::clutch) + ", " + switch_text("stop", states, &State::stop);
  const Reason& device = states.back()->device;
  return text + (states.back()->device_ok ? "; device ready" : "; device: " + knuckle::text(device));
}

std::string axis_text(const std::vector<const SlaveState*>& states, int joint) {
  const auto axis = static_cast<std::size_t>(joint);
  Range length, a, b, told, spool;
  for (const SlaveState* state : states) {
    length.add(state->cylinder_m[joint]);
    a.add(state->pressure_Pa[2 * axis] / kBar);
    b.add(state->pressure_Pa[2 * axis + 1] / kBar);
    told.add(100 * state->valve_command[joint]);
    spool.add(100 * state->spool[joint]);
  }
  return fmt::format(
      "{:<6} cylinder {:.3f} to {:.3f} m, head {:.0f} to {:.0f} bar, rod {:.0f} to {:.0f} bar, valve told "
      "{:.0f} to {:.0f} %, spool {:.0f} to {:.0f} %",
      kJointNames[axis], length.low, length.high, a.low, a.high, b.low, b.high, told.low, told.high, spool.low,
      spool.high);
}

std::string estimate_text(const std::vector<const SlaveState*>& states) {
  Range force, confidence;
  std::uint8_t doubts = 0;
  for (const SlaveState* state : states) {
    force.add(state->tip_force_N.norm());
    confidence.add(state->confidence);
    doubts |= state->confidence_reasons;
  }
  const std::string why = estimation::doubt_text(doubts);
  return fmt::format("estimate: tip force {:.0f} to {:.0f} N, confidence {:.2f} to {:.2f}{}; {}", force.low, force.high,
                     confidence.low, confidence.high, why.empty() ? "" : " (" + why + ")",
                     switch_text("contact", states, &SlaveState::contact));
}

/// Limits that were hit, since when, and whether still at the stop.
std::string limits_text(const std::vector<const SlaveState*>& states) {
  std::string text;
  for (unsigned bit = 0; limit_word(bit) != nullptr; ++bit) {
    std::optional<Time> first;
    int hit = 0;
    for (const SlaveState* state : states) {
      if ((state->limits >> bit & 1U) == 0) continue;
      if (!first) first = state->at;
      ++hit;
    }
    if (!first) continue;
    text += fmt::format("{}{} ({:.0f} % of the time, first at {})", text.empty() ? "" : ", ", limit_word(bit),
                        100.0 * hit / static_cast<double>(states.size()), at_text(*first));
  }
  return "limits hit: " + (text.empty() ? std::string("none") : text);
}

std::string gate_text(const std::vector<const SlaveState*>& states, const MachineDescription& machine) {
  double most_held = 0, least_authority = 1, highest_N = 0;
  for (const SlaveState* state : states) {
    most_held = std::max(most_held, (state->wanted - state->valve_command).cwiseAbs().maxCoeff());
    least_authority = std::min(least_authority, state->authority);
    highest_N = std::max(highest_N, state->tip_force_N.norm());
  }
  const SlaveState& last = *states.back();
  std::string text = fmt::format(
      "gate: changed the wanted commands by up to {:.0f} % of stroke; force ceiling {:.0f} N{}; "
      "assist {}",
      100 * most_held, machine.limits.tip_force_N,
      highest_N > machine.limits.tip_force_N ? ", exceeded" : ", not reached",
      last.assist_force_limit_N > 0 ? fmt::format("{:.0f} N", last.assist_force_limit_N) : std::string("off"));
  return text +
         fmt::format("; loss policy: authority {:.2f} at the stop, lowest {:.2f}", last.authority, least_authority);
}

}  // namespace

std::vector<std::string> last_second(const Stop& stop, const Window& window, const MachineDescription& machine) {
  std::vector<std::string> lines;
  const auto ours = last_of(window.operator_states, stop);
  const auto states = last_of(window.machine, stop);
  if (!ours.empty()) lines.push_back("operator, at the device: " + operator_text(ours));
  if (states.empty()) return lines;
  lines.push_back("operator, as the machine heard it: " + operator_text(states));
  for (int joint = 0; joint < kJoints; ++joint) lines.push_back(axis_text(states, joint));
  lines.push_back(estimate_text(states));
  lines.push_back(limits_text(states));
  lines.push_back(gate_text(states, machine));
  if (states.back()->blocking && !same_cause(states.back()->blocking, stop.reason))
    lines.push_back("in the way of moving on: " + reason_text(machine, states.back()->blocking));
  return lines;
}

}  // namespace knuckle::explain
