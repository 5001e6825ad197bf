#include "app/console/machine_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/trust.h"
#include "machine/reason_text.h"

namespace knuckle::console {
namespace {

/// "boom, arm and bucket"
std::string listed(const std::vector<std::string>& all) {
  std::string text;
  for (std::size_t i = 0; i < all.size(); ++i) text += (i == 0 ? "" : i + 1 == all.size() ? " and " : ", ") + all[i];
  return text;
}

/// "arm 220 bar, bucket 205 bar", of the joints that `which` holds for, the fullest first.
template <typename Which>
std::string pressures_of(const JointLoads& loads, const Which& which) {
  std::vector<std::size_t> joints;
  for (std::size_t i = 0; i < kJoints; ++i)
    if (which(loads[i])) joints.push_back(i);
  std::sort(joints.begin(), joints.end(),
            [&](std::size_t a, std::size_t b) { return loads[a].pressure_Pa > loads[b].pressure_Pa; });
  std::string text;
  for (const std::size_t i : joints)
    text += fmt::format("{}{} {:.0f} bar", text.empty() ? "" : ", ", kJointNames[i], 1e-5 * loads[i].pressure_Pa);
  return text;
}

/// Nobody leads it, nor is about to.
bool idle(const ConsoleView& view) noexcept {
  const Mode mode = view.machine.mode;
  return view.link.heard && (mode == Mode::kReady || mode == Mode::kFault || mode == Mode::kEStop);
}

}  // namespace

ForceText force_text(const ConsoleView& view) noexcept {
  const SlaveMessage& m = view.machine;
  if (!view.link.heard || !(m.confidence > kLeastConfidence)) return {};
  return {true, m.contact, m.contact ? "In contact" : "No contact"};
}

std::string direction_text(int joint, bool angle_grows) {
  static constexpr std::array<std::array<const char*, 2>, kJoints> kWords{
      {{"boom down", "boom up"}, {"arm in", "arm out"}, {"bucket in (curl)", "bucket out"}}};
  return kWords[static_cast<std::size_t>(joint)][angle_grows ? 1 : 0];
}

std::string reason_text(const Reason& reason, const BusDescription& bus, HandSource hand) {
  const ReasonCode code = reason.code;
  const bool keys = hand == HandSource::kKeyboard;
  if (code == ReasonCode::kHomeOffered)
    return subject_text(reason) +
           ": pressures failed: to go home slowly without them hold the button on the right for 3 s; to try them again "
           "press and release enable";
  if (hand == HandSource::kDevice) return text(reason, bus);
  if (code == ReasonCode::kNoPresence || code == ReasonCode::kEnableNotPressed)
    return keys ? "hold Shift (enable) and move with Q A W S E D"
                : "hold the right bumper (enable) and move with the sticks";
  if (code == ReasonCode::kPresenceLost)
    return keys ? "Shift and the keys that move it were let go of" : "bumper and sticks were let go of";
  return text(reason, bus);
}

BlindPress blind_press(const ConsoleView& view, const JointLoads& loads) {
  BlindPress press;
  if (!view.link.heard || force_text(view).known) return press;
  // Oil that leaves over a relief valve speeds nothing up.
  const auto surely = [](const JointLoad& load) { return load.presses() && (load.at_relief || load.steady); };
  std::vector<std::string> at_relief;
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (!surely(loads[i])) continue;
    press.least_N = std::max(press.least_N, loads[i].beyond_Nm / loads[i].reach_m);
    if (loads[i].at_relief) at_relief.emplace_back(kJointNames[i]);
  }
  if (!at_relief.empty())
    press.text = "pressing hard; cannot be measured: " + listed(at_relief) + " at relief";
  else if (press.least_N > 0)
    press.text = "pressing; cannot be measured: " + pressures_of(loads, surely);
  return press;
}

std::string still_pressing(const ConsoleView& view, const JointLoads& loads) {
  if (!idle(view)) return "";
  const ForceText said = force_text(view);
  const double force_N = view.machine.tip_force_N.norm();
  if (said.contact && force_N >= kWorthSaying_N)
    return fmt::format("the bucket still presses with {} N", 100 * std::lround(force_N / 100));
  if (said.known) return "";
  const std::string oil = pressures_of(loads, [](const JointLoad& load) { return load.presses() && load.lasts; });
  return oil.empty() ? "" : "still pressing: " + oil;
}

std::string shut_in(const ConsoleView& view, const JointLoads& loads) {
  if (!idle(view)) return "";
  const std::string oil =
      pressures_of(loads, [](const JointLoad& load) { return load.pushes_on_its_end() && load.lasts; });
  return oil.empty() ? "" : "oil shut in, " + oil;
}

std::vector<std::string> end_texts(const JointLoads& loads) {
  std::vector<std::string> texts;
  for (int joint = 0; joint < kJoints; ++joint)
    if (const int end = loads[static_cast<std::size_t>(joint)].end; end != 0)
      texts.push_back(direction_text(joint, end > 0) + ": at its end");
  return texts;
}

LessFelt less_felt(const ConsoleView& view) {
  const SlaveMessage& m = view.machine;
  if (m.mode != Mode::kEngaged) return {};
  const std::string sure = fmt::format("{:.0f} %", 100 * m.confidence);
  const Reason& warning = view.hand.warning;
  const bool recorded = std::isfinite(m.confidence);
  if (recorded && !(m.confidence > kLeastConfidence) && (!warning || warning.code == ReasonCode::kCuesEstimate))
    return {"force not known", "the machine's force is not known (confidence " + sure + "): what is felt is not it"};
  if (warning) return {"less force felt", text(warning)};
  if (recorded && trust(m.confidence) < 1)
    return {"force not sure", "the machine's force is not sure: confidence " + sure};
  return {};
}

bool feels_end_of_range(const ConsoleView& view, const MachineDescription& machine) noexcept {
  if (view.machine.mode != Mode::kEngaged || !view.hand.presence) return false;
  for (std::size_t i = 0; i < kJoints; ++i)
    if (end_of_range(machine, i, view.hand.ghost_rad[static_cast<Eigen::Index>(i)]) != 0) return true;
  return false;
}

std::string piece_news(const ConsoleView& view) {
  constexpr double kShown_s = 5;
  const sim::WorldEventRing& events = view.truth.events;
  if (!view.simulated) return "";
  for (std::uint64_t n = events.count; n > 0 && n + sim::WorldEventRing::kCapacity > events.count; --n) {
    const sim::WorldEvent& event = events.at(n - 1);
    if (const double ago_s = view.simulated_s - event.t_s; ago_s < 0 || ago_s > kShown_s) break;
    if (event.kind == sim::WorldEventKind::kPieceBroke) return "a piece broke off";
    if (event.kind == sim::WorldEventKind::kPieceDown) return "a piece fell to the ground";
  }
  return "";
}

std::vector<std::string> limit_texts(const ConsoleView& view, const MachineDescription& machine,
                                     const Kinematics& kinematics, const JointLoads& loads, bool measured) {
  if (!view.link.heard) return {};
  const SlaveMessage& m = view.machine;
  std::vector<std::string> texts = measured ? end_texts(loads) : std::vector<std::string>();
  const bool range_named = !texts.empty();
  for (int joint = 0; measured && joint < kJoints; ++joint) {
    const auto i = static_cast<std::size_t>(joint);
    const auto cylinder = kinematics.cylinder_at(joint, m.position_rad[joint]);
    for (std::size_t side = 0; cylinder && side < 2; ++side) {
      if (!at_relief(machine.hydraulics, m.pressure_Pa[2 * i + side])) continue;
      const bool extends = side == 0;
      texts.push_back(direction_text(joint, extends == (cylinder->lever_m > 0)) + ": oil at relief");
    }
  }
  for (unsigned bit = 0; limit_word(bit) != nullptr; ++bit) {
    const bool named = (1U << bit) == kLimitJointRange && range_named;
    if ((m.limits & (1U << bit)) != 0 && !named) texts.emplace_back(limit_word(bit));
  }
  return texts;
}

std::string own_pause_text(double seconds) {
  return fmt::format("this console itself did not run for {:.0f} ms: close other programs on this computer",
                     1e3 * seconds);
}

}  // namespace knuckle::console
