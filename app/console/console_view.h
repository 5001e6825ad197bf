// What the console's screens show: the newest of everything, plain data that crosses from the loops' thread to the
// window's through mailboxes.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/histogram.h"
#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "sim/world.h"
#include "transport/link_messages.h"
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

/// The operator's side of the newest step.
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
};

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

/// What enable has ceased to count for, though it may still be held.
enum class Dropped : std::uint8_t { kNo, kNoFocus, kTooSmall, kStalled, kNewStart };

/// What the loop makes of the newest input; meaningless where a scenario leads.
struct InputSide {
  bool unattended = false;      ///< The window has no focus: all inputs count as released.
  bool release_enable = false;  ///< Enable has been held since one of Dropped: it counts only once it was released.
  /// The same, and also where nobody can know whether it is still held: a window without focus is not told of keys.
  Dropped dropped = Dropped::kNo;
  double own_pause_s = 0;  ///< Not 0: this console did not run for so long, and the machine's fault comes of that.
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
  bool simulated = false, paused = false;
  bool led_by_scenario = false;  ///< By its own operator; what is held in the window has no effect.
  double simulated_s = 0;        ///< Of the session on screen.
  SimulatedTruth truth;          ///< Where simulated.
};

}  // namespace knuckle::console
