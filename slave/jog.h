// Small motions of one valve at a time, before sensors and signs are checked: pilot pressure on, an opening that grows
// open loop up to a small one, valve closed, pilot pressure off. jog_gate() (safety_gate.h) judges every command.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/bus_frames.h"
#include "machine/description.h"
#include "machine/encoder_length.h"
#include "slave/canopen_client.h"
#include "slave/closed_frames.h"
#include "slave/j1939_bus.h"
#include "slave/node_setup.h"
#include "slave/safety_gate.h"
#include "slave/valve_monitor.h"
#include "transport/can_bus.h"

namespace knuckle::slave {

/// Newest values as the nodes report them: not zeroed, not filtered, none left out.
struct RawSensors {
  std::array<double, 6> pressure_Pa{};
  JointVector length_m = JointVector::Zero();
  JointVector encoder = JointVector::Zero();  ///< As it says it, m or rad: also where that makes no length.
  double tilt_rad = 0;
  std::array<Time, 10> at{};               ///< Arrivals: pressures, lengths, tilt; kNever before the first.
  std::array<bool, 6> pressure_invalid{};  ///< As reported by the transmitter.
  std::array<bool, 3> no_length{};         ///< An angle that its joint cannot have; length_m is an older one.
  std::array<bool, 10> impossible{};       ///< As in `at`: see possible(); a length likewise is an older one.
  [[nodiscard]] Time oldest() const noexcept;
  /// Place in `at` of the first that is impossible or reported as invalid; nullopt where none is.
  [[nodiscard]] std::optional<std::size_t> invalid() const noexcept;
};

/// Whether a sensor that works can send this value. The zero of an encoder need not be known.
[[nodiscard]] bool possible(const FrameField& field, double value, const MachineDescription& machine) noexcept;

struct JogPlan {
  int joint = 0;
  double peak = 0;         ///< Command that is not exceeded, fraction of spool stroke; its sign is the direction.
  double rise_1ps = 0.05;  ///< The command's slope up to there.
  double travel_m = 0.02;  ///< Ends after so much motion of its own encoder.
  double longest_s = 10;
  double back_m = 1e9;       ///< Ends after so much motion against its command.
  bool until_stall = false;  ///< Ends where the cylinder, having moved, stands still against the open valve.
  /// Where it has travelled, command frames end instead of the command, for kSilence beyond their guard's time: what
  /// the machine's own controller does when nobody tells it anything.
  bool then_silence = false;
};
/// Of the joint that moves, since its motion began; the command as it passed the gate, and so the spool where nobody
/// tells it.
struct JogSample {
  double t_s = 0, command = 0, spool = 0;
  JointVector length_m = JointVector::Zero();
  std::array<double, 6> pressure_Pa{};
  bool silent = false;  ///< After command frames had ended; t_s since then.
};
enum class JogEnd : std::uint8_t { kTravelled, kStalled, kTime, kWrongWay };

/// What a node did while what its guard waits for was withheld from it: seconds since it was withheld; nullopt where it
/// did not. Of a module with outputs its cylinder's motion tells whether it stopped.
struct GuardSeen {
  bool by_heartbeat = false;  ///< That was the controller's heartbeat; else the node's set-points.
  bool other_guard = false;   ///< It waits for the heartbeat as well, which was not tried.
  enum class Tried : std::uint8_t {
    kYes,
    kNoDeadBand,    ///< Too small for an opening that could be told from noise.
    kDidNotFollow,  ///< The valve's spool did not come to that opening.
    kOthersFirst,   ///< Another node takes no longer time for the heartbeat, and would act before.
  } tried = Tried::kYes;
  std::optional<double> told_s;     ///< It said that it does not work.
  std::uint16_t emergency = 0;      ///< The code it said; 0 where it said none.
  std::optional<double> stopped_s;  ///< A valve's spool came back and stayed; the enable node took pilot pressure away.
  std::optional<double> pilot_off_s;  ///< Of a valve or a module: pilot pressure went off before that was sure.
  bool asked = false;                 ///< It sent process data no more, but answered when it was asked by SDO.
  bool silent = false;  ///< It says no more where its spool is, whether pilot pressure is on, or its cylinder's length.
  bool others_stopped = false;    ///< Of the enable node: a valve had stopped before, which may be why.
  double guard_s = 0;             ///< The guard's own time.
  bool early = false;             ///< What it did came before that, so from something else.
  std::optional<double> crept_m;  ///< The cylinder moved at the small opening.
};

/// Every step sends SYNC, commands that passed the gate, and the controller's heartbeat. Whatever ends a task early
/// leaves valves neutral and pilot pressure off from that very step on.
class Jog {
 public:
  enum class Phase : std::uint8_t {
    kRest,       ///< Neutral, no pilot pressure.
    kPilotUp,    ///< Switched on, not reported yet; valves closed.
    kHeld,       ///< Pilot pressure on for a while, valves closed.
    kMoving,     ///< One valve open.
    kOpening,    ///< One valve open inside its dead band: nothing moves.
    kWithheld,   ///< Likewise, and what its node's guard waits for is not sent; or the enable node's heartbeat; or,
                 ///< while a joint moves, command frames or what a module's guard waits for.
    kClosing,    ///< Valves closed, pilot pressure still on: the spool closes, pressures settle.
    kPilotDown,  ///< Switched off, until that is reported, where it is.
  };
  static constexpr Duration kPilotPatience = 1s;  ///< For what is said of it.
  static constexpr Duration kSettle = 400ms;      ///< Of kClosing.
  static constexpr Duration kSilence = 1500ms;    ///< JogPlan::then_silence, try_outputs()

  /// Bus must outlive it. @throws InputError where the machine file cannot be worked with.
  Jog(const MachineDescription& machine, CanBus& bus);

  /// One SYNC period.
  void step(Time now) noexcept;

  // Between steps.
  /// Configures and starts all nodes anew; pilot pressure stays off.
  void start() noexcept;
  /// A task, at rest only; else nothing happens. Pilot pressure on with closed valves for so long, and off again.
  void hold_pilot(Duration time) noexcept;
  /// Another: pilot pressure on, the motion, valve closed, pilot pressure off.
  void move(const JogPlan& plan) noexcept;
  /// Another: pilot pressure on, a valve open inside its dead band, then no set-points for it, or no heartbeat where
  /// its guard waits for that, as the enable node's does, until its guard has acted or patience ends; pilot pressure
  /// off. See guard_seen(). What the node says of it is no trouble until start(), which is needed after it.
  /// @param node of a valve, or the enable node. @param joint whose valve is opened, one of the node's.
  void try_guard(const NodeDescription& node, int joint) noexcept;
  /// Another: as move(), but where the cylinder has travelled, what this module's guard waits for is not sent: its
  /// outputs must end the motion. Of inputs that it sends no more then, lengths are asked by SDO. What it says is no
  /// trouble until start(), which is needed after it.
  /// @param joint of the plan: moved by one of its outputs.
  void try_outputs(const NodeDescription& module, const JogPlan& plan) noexcept;
  /// How long a guard is waited for, and its node's answer, or a cylinder that moves to stop.
  [[nodiscard]] Duration guard_patience(bool in_motion) const noexcept;
  /// Ends the task, if there is one, with trouble kOperatorStop.
  void stop() noexcept;
  /// Works through SDO steps of one node beside everything else; see dialogue().
  void write_objects(std::uint8_t node, SdoScript script);
  /// Of the last write_objects().
  [[nodiscard]] const std::optional<SdoDialogue>& dialogue() const noexcept { return dialogue_; }

  [[nodiscard]] Phase phase() const noexcept { return phase_; }
  /// Why the last task ended early, or which node failed; kNone otherwise.
  [[nodiscard]] const Reason& trouble() const noexcept { return trouble_; }
  /// Of this step, while a motion goes on.
  [[nodiscard]] const std::optional<JogSample>& sample() const noexcept { return sample_; }
  /// How the last motion ended.
  [[nodiscard]] JogEnd end() const noexcept { return end_; }
  /// Of the last try_guard().
  [[nodiscard]] const GuardSeen& guard_seen() const noexcept { return guard_seen_; }
  [[nodiscard]] const RawSensors& sensors() const noexcept { return sensors_; }
  /// kSensorInvalid of the first value that RawSensors::invalid() finds; kNone where it finds none.
  [[nodiscard]] Reason invalid() const noexcept;
  [[nodiscard]] const CanopenClient& client() const noexcept { return client_; }
  /// Whether command frames may go out from the J1939 address, where some do.
  [[nodiscard]] bool may_command() const noexcept { return j1939_.may_command(); }
  /// As the enable node says, or the machine by itself; nullopt where no frame says it, or none has come.
  [[nodiscard]] std::optional<bool> e_stop_open() const noexcept;
  [[nodiscard]] bool tells_e_stop() const noexcept { return machine_.bus.has_enable() || status_[0].told; }

 private:
  struct Status {
    bool told = false;  ///< By frames that the machine sends.
    std::uint8_t subject = 0;
    Duration age_limit{};
    std::optional<bool> on{};
    Time at = kNever;
  };
  void take_broadcast(const CanFrame& frame, Time now) noexcept;
  void take(const BroadcastFrame& known, const CanFrame& frame, Time now) noexcept;
  void take(const BroadcastField& field, std::optional<std::uint64_t> raw, Time now) noexcept;
  [[nodiscard]] bool tells_pilot() const noexcept { return machine_.bus.has_enable() || status_[1].told; }
  [[nodiscard]] bool pilot_on() const noexcept;
  void note_silence(Time now) noexcept;
  void note_sample(Time now) noexcept;
  void hear(Time now) noexcept;
  void take(const CanFrame& frame, Time now) noexcept;
  void take(const FrameField& field, double value, Time now) noexcept;
  void take_length(const FrameField& field, double reading) noexcept;
  void refuse_short(std::uint8_t subject, std::size_t seen_bytes, std::size_t bytes) noexcept;
  void begin(Phase phase) noexcept;
  void enter(Phase phase, Time now) noexcept;
  void end_early(const Reason& why) noexcept;
  [[nodiscard]] JointVector wanted(Time now) const noexcept;
  [[nodiscard]] JogState judged(Time now) const noexcept;
  void note_motion(Time now) noexcept;
  void go_on(Time now) noexcept;
  void watch_creep(Time now) noexcept;
  void watch_pilot() noexcept;
  void watch_spools() noexcept;
  void open_for_guard(Time now) noexcept;
  void note_guard(Time now) noexcept;
  void note_told(double t_s) noexcept;
  [[nodiscard]] bool others_stopped() const noexcept;
  [[nodiscard]] Time guarded_said_at() const noexcept;
  void ask_guarded(Time now) noexcept;
  [[nodiscard]] bool tries_outputs() const noexcept { return guarded_ != 0 && plan_.then_silence; }
  void ask_inputs(Time now) noexcept;
  void hear_inputs(const CanFrame& frame, Time now) noexcept;
  void begin_guard(const NodeDescription& node) noexcept;
  void await_pilot(bool on, Phase then, Time now) noexcept;

  MachineDescription machine_;
  EncoderLengths lengths_;
  CanBus& bus_;
  CanopenClient client_;
  J1939Bus j1939_;
  std::vector<BusFrame> frames_;            // sized once, at construction
  std::vector<BroadcastFrame> broadcasts_;  // likewise
  ClosedFrames closed_;
  std::array<Status, 2> status_{};  // E-stop chain closed, pilot pressure on
  GateLimits limits_;
  RawSensors sensors_;
  std::optional<SdoDialogue> dialogue_;

  Phase phase_ = Phase::kRest;
  Time since_ = kNever, stepped_at_ = kNever;  // of the phase; the last step
  Phase with_pilot_ = Phase::kHeld;            // what comes once it is on
  Duration hold_{};
  JogPlan plan_;
  JointVector from_m_ = JointVector::Zero();
  double still_at_m_ = 0, still_since_s_ = 0;
  std::uint8_t guarded_ = 0;                       // node of try_guard() or try_outputs(); 0 in other tasks
  double opening_ = 0;                             // of its valve; 0 for the enable node
  Time asked_at_ = kNever, answered_at_ = kNever;  // of the guarded node, by SDO
  int asked_joint_ = 0;                            // whose length, of a module
  Time inputs_at_ = kNever;                        // that the module sent by itself
  std::array<bool, 10> of_module_{};               // places of RawSensors::at
  GuardSeen guard_seen_;
  double guard_earliest_s_ = 0;  // since it was withheld: before that its guard cannot act
  Time stands_since_ = kNever;   // the spool at the opening; or back, told, and pilot pressure on
  ValveMonitor valves_;
  GateResult gate_;
  std::optional<JogSample> sample_;
  JogEnd end_ = JogEnd::kTime;
  Reason trouble_;
};

}  // namespace knuckle::slave
