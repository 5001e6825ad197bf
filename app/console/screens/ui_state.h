// What the person has chosen in the window: nothing of it leaves the window but through ConsoleInput.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "app/console/hand_input.h"
#include "app/console/keys.h"
#include "app/console/screens/measures.h"
#include "app/console/widgets/units.h"

namespace knuckle::console::screens {

/// What a simulated session starts with; taken up by the next reset.
struct SimulationChoice {
  int scenario = 0;  ///< Index into ConsoleFacts::scenarios.
  float delay_ms = 0, jitter_ms = 0, loss_percent = 0;
  bool link_chosen = false;  ///< By the person; before, the three follow the session that runs.
  bool demo = false;         ///< The scenario's own operator drives.
  bool operator==(const SimulationChoice&) const = default;
};

struct EventChoice {
  std::array<char, 64> text{};
  int least_severity = 0;
};

struct UiState {
  Screen screen = Screen::kOperate;
  bool light = false;
  UnitSystem units = UnitSystem::kMetric;
  bool help = false;
  bool side_view = true;
  Measures measures;
  bool stop = false;  ///< Latched until released on purpose.
  bool home = false;  ///< Its button is held.
  float position_scale = 0, force_scale = 0;
  bool scales_chosen = false;   ///< By the person; before, the sliders follow what is in use.
  AssistSettings assist;        ///< At first, and with another scenario, as the scenario says.
  float assist_limit_N = 1000;  ///< Waits here while it is switched off.
  bool hold_to_run = false;     ///< The mouse enables while it pulls the tip or holds a button of the pad.
  float force_most_N = 5000;    ///< The gauge's end: more is too much here.
  HeldKeys pad;                 ///< Buttons of it that are held.
  bool muted = false;           ///< No alarm is heard.
  std::optional<std::string> accepted_uncalibrated;  ///< The machine of which the person knows that it is.
  std::string sound_problem;                         ///< Why none can be; empty: they can, or nobody asked for any.
  bool typing = false;                               ///< Into a field: keys lead nothing.
  bool typing_number = false;                        ///< Into one that takes no text: Space is Stop all the same.
  bool enable_ignored = false;                       ///< Its key is held without counting.
  bool pad_ignored = false;                          ///< Likewise a gamepad's bumper.
  bool pull_ignored = false;                         ///< Likewise the mouse's button.
  bool paused = false;
  std::uint32_t reset_count = 0;
  std::uint32_t bookmarks = 0;               ///< Set so far.
  SimulationChoice simulation;               ///< Chosen for the next session.
  SimulationChoice running{.scenario = -1};  ///< What the one on screen began with.
  EventChoice events;
  std::string export_path = "knuckle-events.csv", export_result;
};

}  // namespace knuckle::console::screens
