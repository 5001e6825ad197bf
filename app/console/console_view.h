// What the console's screens show: the newest of everything, plain data that crosses from the loops' thread to the
// window's through mailboxes.
#pragma once

#include <cstdint>
#include <string>

#include "core/histogram.h"
#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "master/master_state.h"
#include "sim/world.h"
#include "transport/link_messages.h"
#include "transport/machine_readings.h"
#include "transport/machine_status.h"

namespace knuckle::console {

// What becomes of the recording, for the light on every screen.

struct RecordingLight {
  enum class State : std::uint8_t { kOff, kOn, kStopped };
  State state = State::kOff;
  bool real = false;             ///< Something real is driven: that it is not recorded stands out.
  std::uint64_t free_bytes = 0;  ///< On the disk; 0: not known yet.
  std::uint64_t steps_lost = 0;  ///< Of the loops, for which there was no room.
  std::string why;               ///< Of kStopped.
};

/// The operator's side of one step.
struct OperatorSide {
  Reason device;  ///< Why the device cannot be used, or leads nothing: the far end's machine is another one.
  bool presence = false, enable = false, clutch = false, stop = false;
  JointVector ghost_rad = JointVector::Zero();       ///< Machine pose that the hand asks for, not clamped.
  JointVector set_point_rad = JointVector::Zero();   ///< Clamped, as sent.
  PlanarVector sent_force_N = PlanarVector::Zero();  ///< Sent to the device, as a force at the hand.
  double position_scale = 1;                         ///< Machine metres per hand metre.
  double force_scale = 1;                            ///< Hand newtons per machine newton.
  AssistSettings assist;
  Reason warning;            ///< Such as the energy observer lowering the force.
  double hand_energy_J = 0;  ///< Net work of the rendered force on the hand.
  double home_asked = 0;     ///< MasterLoop::home_asked()

  /// What MasterState or SlaveState have too is called as there.
  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [device, presence, enable, clutch, stop, ghost_rad, set_point_rad, sent_force_N,
                                  position_scale, force_scale, assist, warning, hand_energy_J, home_asked] = s;
    visit("device", s.device);
    visit("presence", s.presence);
    visit("enable", s.enable);
    visit("clutch", s.clutch);
    visit("stop", s.stop);
    visit("ghost_rad", s.ghost_rad);
    visit("setpoint_rad", s.set_point_rad);
    visit("sent_force_N", s.sent_force_N);
    visit("position_scale", s.position_scale);
    visit("force_scale", s.force_scale);
    visit("assist_force_limit_N", s.assist.force_limit_N);
    visit("assist_stop_on_object", s.assist.stop_on_object);
    visit("warning", s.warning);
    visit("hand_energy_J", s.hand_energy_J);
    visit("home_asked", s.home_asked);
  }
};

/// As the operator's loop has it, but for the pose that the hand asks for, which its state has clamped alone.
/// @param position_scale, @param force_scale of the device's file: in use until others were chosen.
[[nodiscard]] OperatorSide operator_side(const master::MasterState& state, double position_scale,
                                         double force_scale) noexcept;

/// Silence after which the machine counts as not heard: 50 messages.
inline constexpr double kLinkLost_s = 0.25;

/// The link as the operator's side sees it.
struct LinkSide {
  bool heard = false;          ///< The machine, ever.
  double silence_s = 0;        ///< Age of the newest message.
  double neutral_after_s = 0;  ///< The machine goes to neutral when it has received nothing for so long.
  double round_trip_s = 0;
  Histogram round_trip;      ///< Of the last 10 s.
  Histogram arrival_jitter;  ///< Likewise: how far from the machine's period messages come in.
  double loss = 0;           ///< Share of the machine's messages that never came, likewise; grows in a silence.
  Histogram hand_to_valve;   ///< Likewise: device report to valve command on the wire.
};

/// The simulation's true state; there is none of a real machine.
struct SimulatedTruth {
  double pump_Pa = 0;
  JointVector joint_rad = JointVector::Zero();
  sim::WorldEventRing events;
};

/// Why enable no longer counts although it may still be held.
enum class Dropped : std::uint8_t { kNo, kNoFocus, kTooSmall, kStalled, kNewStart };

/// What the loop makes of the newest input; meaningless where a scenario leads.
struct InputSide {
  bool unattended = false;      ///< The window has no focus: all inputs count as released.
  bool release_enable = false;  ///< Enable counts only after it was released: it is held since one of Dropped.
  /// Which one. Also set where nobody can know whether enable is still held: a window without focus is not told of
  /// keys.
  Dropped dropped = Dropped::kNo;
  double own_pause_s = 0;  ///< So long this console did not run, and the machine's fault comes of that; else 0.
};

struct ConsoleView {
  Time now{};             ///< Of the operator's loop: of the session on screen where simulated.
  std::uint32_t run = 1;  ///< Which session; counts up at every restart.
  OperatorSide hand;
  InputSide input;
  LinkSide link;
  SlaveMessage machine;  ///< Newest; meaningless before link.heard.
  MachineStatus status;  ///< Newest; meaningless before status_heard.
  bool status_heard = false;
  /// Of a recording: what the status says of valves, pilot pressure and force is of the machine's own newest step.
  bool status_of_steps = false;
  /// Of an imported table: what its sensors said, and nothing of modes, limits or the hand.
  bool sensors_alone = false;
  double status_age_s = 0;
  MachineReadings readings;  ///< As told last.
  bool simulated = false, paused = false;
  bool led_by_scenario = false;  ///< By its own operator; what is held in the window has no effect.
  double simulated_s = 0;        ///< Of the session on screen.
  SimulatedTruth truth;          ///< Where simulated.
};

}  // namespace knuckle::console
