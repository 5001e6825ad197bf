// The controller's side of the machine bus: starts all nodes, keeps SYNC and heartbeat going, watches every node, and
// sends what the safety gate let pass, to valves or to the machine's own controller. Non-blocking: everything moves on
// in begin_step() and end_step(). On a bus without nodes there is nothing to start, and no SYNC and no heartbeat.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "slave/bus_watch.h"
#include "slave/command_frames.h"
#include "slave/emergency_log.h"
#include "slave/node_setup.h"
#include "slave/safety_gate.h"
#include "transport/can_bus.h"

namespace knuckle::slave {

class CanopenClient {
 public:
  enum class Phase : std::uint8_t {
    kIdle,         ///< Nothing sent yet.
    kConfiguring,  ///< Pre-operational, then SDO dialogues, all nodes in parallel; also the boot of one that is reset.
    kStarting,     ///< Waiting for every node to report operational.
    kActivating,   ///< Valves through DISABLED and HOLD to ACTIVE.
    kChecking,     ///< Asking every node whether an error is left.
    kOperational,
    kFailed,  ///< See fault(); stays until restart().
  };
  /// @throws InputError where two nodes have the same id or an id is not in 1...127.
  CanopenClient(const MachineDescription& machine, CanBus& bus);

  /// A received frame. @returns false where it is none of the client's: process data of a sensor, or of nobody.
  bool receive(const CanFrame& frame, Time now) noexcept;
  /// First thing in a loop step, after receiving: start-up, supervision.
  void begin_step(Time now) noexcept;
  /// Last thing in a loop step: set-points every nth SYNC (those that drop to neutral at once) and enable output, or
  /// command frames; the controller's heartbeat, which therefore stops with the loop, and SYNC.
  /// @param led an operator leads the machine: pilot pressure is asked for.
  /// @param may_command else no command frame goes out from the J1939 address; others do.
  void end_step(const PassedCommands& commands, bool led, Time now, bool may_command = true) noexcept;
  /// Starts all nodes anew; clears the fault. What a node was told before is asked, not told again, and only a node
  /// that does not take what it is told, or keeps an error, is reset, once; one with analogue outputs never.
  void restart() noexcept;

  /// From now on nodes that send nothing but the pressures of this joint's cylinder are needed no more, or again.
  void need_pressures(int joint, bool on) noexcept;

  /// What is not sent, to try a guard.
  enum class Withheld : std::uint8_t { kNothing, kSetPoints, kHeartbeat };
  /// From the next step on. What this node and the enable node (where that is tried, all nodes) do because of it is no
  /// fault until restart(), but for inputs that do not come while a valve is tried: pilot pressure must be known.
  /// @param node whose guard is tried; only its set-points are withheld. 0: command frames for the machine's own
  /// controller.
  void withhold(Withheld what, std::uint8_t node) noexcept;
  /// What this node's guard waits for: the heartbeat, but of a valve the set-points unless it has taken no time for
  /// those.
  [[nodiscard]] Withheld guarded_by(std::uint8_t node) const noexcept;
  /// Whether the node has taken a time for the heartbeat.
  [[nodiscard]] bool waits_for_heartbeat(std::uint8_t node) const noexcept;

  [[nodiscard]] const BusDescription& bus() const noexcept { return description_; }
  [[nodiscard]] Phase phase() const noexcept { return phase_; }
  /// A frame of ours was sent: whoever has heard it may wait for the next.
  [[nodiscard]] bool commanded() const noexcept { return commanded_; }
  [[nodiscard]] bool operational() const noexcept { return phase_ == Phase::kOperational; }
  /// Why start-up failed or operation ended; kNone while healthy.
  [[nodiscard]] const Reason& fault() const noexcept { return fault_; }
  /// What was asked and answered where a node's set-up failed; nothing where it did not.
  [[nodiscard]] const SetupFailure& setup_failure() const noexcept { return setup_failure_; }
  [[nodiscard]] const EmergencyLog& emergencies() const noexcept { return emergencies_; }
  [[nodiscard]] const BusWatch& watch() const noexcept { return watch_; }
  /// Code of an error that the node has told and not taken back; 0 where there is none.
  [[nodiscard]] std::uint16_t emergency_of(std::uint8_t node) const noexcept;
  /// Asks the node whose guard is tried by SDO for what its process data say: the spool of a joint's valve, or the
  /// enable node's inputs. Its answer counts as those.
  void ask(std::uint8_t node, int joint) noexcept;
  // When they were last said; kNever before the first.
  [[nodiscard]] Time valve_seen_at(int joint) const noexcept {
    return valves_[static_cast<std::size_t>(joint)].seen_at;
  }
  [[nodiscard]] Time inputs_seen_at() const noexcept { return inputs_seen_at_; }
  /// Whether the node says that it does not work: by an emergency, its heartbeat or, a valve, its status.
  [[nodiscard]] bool says_stopped(std::uint8_t node) const noexcept;
  /// Whether the node is the device whose guard was proved, as far as it was asked.
  [[nodiscard]] bool same_device(std::uint8_t node) const noexcept;
  // As the enable node says; false where there is none.
  [[nodiscard]] bool e_stop_open() const noexcept { return inputs_seen_at_ != kNever && !inputs_closed_; }
  [[nodiscard]] bool pilot_on() const noexcept { return pilot_on_; }
  /// Whether valves tell where their spools are.
  [[nodiscard]] bool spools_seen() const noexcept { return !description_.by_frames(); }
  /// Actual, [-1, 1]; 0 where nobody tells.
  [[nodiscard]] const JointVector& spool() const noexcept { return spool_; }
  [[nodiscard]] const JointVector& demand() const noexcept {  ///< As last put on the wire.
    return spools_seen() ? demand_ : commands_.demand();
  }
  [[nodiscard]] const CommandFrames& command_frames() const noexcept { return commands_; }
  /// When the controller last took a set-point for a valve; kNever before the first.
  [[nodiscard]] Time set_points_at() const noexcept { return spools_seen() ? set_points_at_ : commands_.sent_at(); }

 private:
  static constexpr int kMostToldAtOnce = 2;
  static constexpr std::uint16_t kNothingSent = 0xFFFF;
  struct Node {
    std::uint8_t id = 0;
    PerJoint<bool> moves{};          ///< The joints whose valves it is.
    std::optional<int> pressures{};  ///< The joint of whose cylinder's pressures it sends, and nothing else.
    bool needed = true;
    double boot_s = 0;  ///< Patience after a reset.
    SdoDialogue before_rest, dialogue, errors;
    bool told = false;  ///< Took the newest NMT command.
    bool operational = false;
    bool was_reset = false;       ///< Since the last start-up that reached operational.
    Time boots_since = kNever;    ///< Reset, and not heard of since.
    Time heard_at = kNever;       ///< Heartbeat.
    std::uint16_t emergency = 0;  ///< EMCY code not yet reset.
    Reason lost{};                ///< Left its working state; kept until restart().
    /// What it is asked now.
    [[nodiscard]] SdoDialogue& asked() noexcept {
      if (!before_rest.done() && !before_rest.failure()) return before_rest;
      return dialogue.done() ? errors : dialogue;
    }
  };
  struct Valve {
    std::uint16_t status_word = 0;
    Time seen_at = kNever;
    std::uint16_t control_word = 0, sent_word = kNothingSent;  ///< Next to send, and last sent.
    bool left_fault = false;                                   ///< By a reset: it begins anew with its first word.
    Time reset_word_at = kNever;                               ///< When the newest word of a reset was chosen.
    double spool = 0;                                          ///< Actual, of stroke.
    std::optional<std::uint8_t> short_bytes;  ///< Of its last status, where that was shorter than mapped.
  };

  Node* find(std::uint8_t id) noexcept;
  [[nodiscard]] const Node* find(std::uint8_t id) const noexcept;
  void enter(Phase phase, Time now) noexcept;
  void fail(const Reason& reason) noexcept;
  void on_heartbeat(Node& node, const CanFrame& frame, Time now) noexcept;
  void on_answer(Node& node, const CanFrame& frame, Time now) noexcept;
  void on_asked(const Node& node, const canopen::SdoResponse& answer, Time now) noexcept;
  void on_emergency(Node& node, const CanFrame& frame, Time now) noexcept;
  bool on_pdo(const CanFrame& frame, Time now) noexcept;
  void on_inputs(const CanFrame& frame, Time now) noexcept;
  void take_inputs(std::uint8_t inputs, Time now) noexcept;
  void on_nmt(const canopen::NmtRequest& request) noexcept;
  void on_valve_status(int joint, const CanFrame& frame, Time now) noexcept;
  void step_phase(Time now) noexcept;
  void configure(Time now) noexcept;
  [[nodiscard]] bool set_up(Node& node, Time now) noexcept;
  [[nodiscard]] bool may_rest(Node& node, Time now) noexcept;
  void start_nodes(Time now) noexcept;
  void check_errors(Time now) noexcept;
  [[nodiscard]] std::uint16_t newest_error(std::uint8_t node) const noexcept;
  [[nodiscard]] bool tell(Node& node, canopen::NmtCommand command) noexcept;
  [[nodiscard]] bool reset(Node& node, Time now) noexcept;
  void forget_process_data() noexcept;
  void activate(Time now) noexcept;
  [[nodiscard]] Reason supervise(Time now) const noexcept;
  [[nodiscard]] Reason valve_fault(std::size_t joint, Time now) const noexcept;
  [[nodiscard]] bool excused(const Node& node) const noexcept;
  void send_set_points(const PassedCommands& commands, Time now) noexcept;
  void send_enable(bool on) noexcept;

  BusDescription description_;
  CommandFrames commands_;
  CanBus& bus_;
  std::vector<Node> nodes_;                // sized once, at construction
  std::array<std::uint8_t, 128> index_{};  // node id -> position in nodes_ + 1
  PerJoint<Valve> valves_{};
  Phase phase_ = Phase::kIdle;
  Time phase_since_ = kNever;
  Reason fault_;
  SetupFailure setup_failure_;
  EmergencyLog emergencies_;
  BusWatch watch_;
  bool commanded_ = false;
  int told_now_ = 0;                // NMT commands of this step
  int asked_now_ = 0, most_asked_;  // SDO requests of this step
  Time inputs_seen_at_ = kNever;
  std::optional<std::uint8_t> short_inputs_;  // bytes of the last ones, where they were shorter than mapped
  bool inputs_closed_ = false, pilot_on_ = false;
  JointVector spool_ = JointVector::Zero(), demand_ = JointVector::Zero();
  Time set_points_at_ = kNever;
  std::uint32_t syncs_ = 0;
  std::optional<std::uint8_t> enable_sent_;  // nothing since the nodes were started
  Time heartbeat_at_ = kNever;
  Withheld withheld_ = Withheld::kNothing;
  std::uint8_t tried_ = 0;  // id of the node whose guard was tried since restart()
};

}  // namespace knuckle::slave
