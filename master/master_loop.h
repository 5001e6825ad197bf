// The operator's side, once a millisecond: device in, set-point out over the link, felt force back to the motors.
#pragma once

#include <cstdint>
#include <optional>

#include "core/joints.h"
#include "core/time.h"
#include "machine/description_fwd.h"
#include "machine/device_description.h"
#include "master/device_driver.h"
#include "master/device_kinematics.h"
#include "master/device_torque.h"
#include "master/felt_law.h"
#include "master/set_point.h"
#include "transport/hid_port.h"
#include "transport/link.h"
#include "transport/link_inbox.h"
#include "transport/link_messages.h"
#include "transport/link_session.h"
#include "transport/machine_readings.h"
#include "transport/machine_status.h"

namespace knuckle::master {

/// How it is known that the far end drives the machine that is led here.
enum class FarEnd : std::uint8_t {
  kTellsItsMachine,  ///< Its MachineStatus names it. Until then messages report the device as not held.
  kIsThisMachine,    ///< Whoever makes this loop makes the far end from the same description: nothing is checked.
};

/// Told of every SlaveMessage of the machine that is followed, in step(), copies and overtaken ones included; echoes by
/// this side's clock.
struct SlaveMessageTap {
  void (*on_message)(void* context, const SlaveMessage& message) = nullptr;
  void* context = nullptr;
};

/// What was set from outside; part of what a step is a function of.
struct MasterSettings {
  bool stop = false, nobody = false, let_go = false, home = false;
  AssistSettings assist;
  double position_scale = 0, force_scale = 0;  ///< As taken by set_scales(); 0: as the device's file says.
};

class MasterLoop {
 public:
  /// @param device, @param machine as their files say; of the machine only its name, joint ranges and soft margins are
  /// used. @param port, @param link outlive this. @param start drawn anew for each loop.
  MasterLoop(const DeviceDescription& device, const MachineDescription& machine, HidPort& port, Link& link,
             const LinkStart& start, ControlLaw law, FarEnd far_end = FarEnd::kTellsItsMachine) noexcept;

  /// One step, every millisecond of the master's clock; sends a MasterMessage every second one, and at once where a
  /// stop or a release of enable has just been noticed.
  void step(Time now) noexcept;

  static constexpr int kHomeSteps = 3000;  ///< Asked for so long without a pause: no slip of a finger.
  static constexpr double kStiffest = 2;   ///< 4 throws a light grip (docs/theory.md).
  /// @param position_scale machine metres per hand metre, @param force_scale hand newtons per machine newton.
  /// @return false, and nothing changes, while the machine is led, where a scale is not positive and finite, or where
  /// the spring, which both scales make, would be stiffer than kStiffest times the device file's.
  bool set_scales(double position_scale, double force_scale) noexcept;

  /// Sent with every set-point from now on.
  void set_assist(const AssistSettings& assist) noexcept { settings_.assist = assist; }
  /// Likewise: a stop besides the device's own button, which needs no device to act.
  void set_stop(bool pressed) noexcept { settings_.stop = pressed; }
  /// While on, the operator asks to go home on two, as by the device's clutch held; needs no device.
  void set_home(bool asked) noexcept { settings_.home = asked; }
  /// While on, messages report the device as not held, whatever it reports itself.
  void set_nobody(bool on) noexcept { settings_.nobody = on; }
  /// For the end: from the next step on the device's torque is off for good, and messages report it as not held.
  void let_go() noexcept;
  /// So many steps ago (0.1 s) that some of the messages that say so have arrived.
  [[nodiscard]] bool has_let_go() const noexcept;
  /// How much of the time that the operator has to ask for going home on two is over: [0, 1].
  [[nodiscard]] double home_asked() const noexcept { return static_cast<double>(home_steps_) / kHomeSteps; }

  void set_tap(SlaveMessageTap tap) noexcept { tap_ = tap; }

  // For displays and recordings; all of the last step.
  [[nodiscard]] const DeviceReading& device() const noexcept { return driver_.reading(); }
  [[nodiscard]] const DeviceDriver& driver() const noexcept { return driver_; }
  [[nodiscard]] const SetPoint& set_point() const noexcept { return set_point_; }
  [[nodiscard]] const EnergyPort& energy() const noexcept { return energy_; }
  /// What the law requested at the tip [N], frame D, before motor limits and without joint walls.
  [[nodiscard]] const PlanarVector& law_force_N() const noexcept { return law_force_N_; }
  /// What was sent to the motors, joint walls and limits included.
  [[nodiscard]] const JointVector& joint_torque_Nm() const noexcept { return torque_Nm_; }
  [[nodiscard]] PlanarVector sent_force_N() const noexcept { return tip_force_of(posture_.jacobian, torque_Nm_); }
  [[nodiscard]] double round_trip_s() const noexcept { return round_trip_s_; }
  [[nodiscard]] double silence_s() const noexcept { return silence_s_; }
  [[nodiscard]] bool stop() const noexcept { return settings_.stop || driver_.reading().stop; }
  [[nodiscard]] double position_scale() const noexcept { return feel_.position_scale * set_point_.scale(); }
  [[nodiscard]] double force_scale() const noexcept { return force_scale_; }
  [[nodiscard]] const AssistSettings& assist() const noexcept { return settings_.assist; }
  [[nodiscard]] const MasterSettings& settings() const noexcept { return settings_; }
  /// Newest message from the machine, its echo by this side's clock; nothing before the first.
  [[nodiscard]] const std::optional<SlaveMessage>& machine() const noexcept { return slave_; }
  /// Likewise what the machine's side reports of itself, and when it came; kNever before the first.
  [[nodiscard]] const std::optional<MachineStatus>& machine_status() const noexcept { return status_; }
  [[nodiscard]] Time machine_status_at() const noexcept { return status_at_; }
  /// What the machine tells of itself; nothing where it tells nothing.
  [[nodiscard]] const std::optional<MachineReadings>& machine_readings() const noexcept { return readings_; }
  /// Of the machine that is led here.
  [[nodiscard]] const MachineName& machine_name() const noexcept { return machine_name_; }
  /// Why the far end cannot be led from here; kNone where it can, and before it has had time to name its machine.
  [[nodiscard]] Reason other_machine() const noexcept { return other_machine_; }
  [[nodiscard]] Reason warning() const noexcept;  ///< Force lowered by the energy watchdog, or replaced by cues.

 private:
  void receive(Time now) noexcept;
  void take(SlaveMessage message, Time arrived, Time now) noexcept;
  void take(const MachineStatus& status, Time now) noexcept;
  void take(const ReadingsMessage& message) noexcept;
  [[nodiscard]] bool same_machine() const noexcept;
  [[nodiscard]] bool leads() const noexcept;
  [[nodiscard]] Mode machine_mode() const noexcept;
  [[nodiscard]] Reason judge_far_end(Time now) const noexcept;
  [[nodiscard]] FeltInputs felt_inputs() const noexcept;
  void render(const DeviceReading& device) noexcept;
  void count_lost(std::uint32_t sequence) noexcept;
  [[nodiscard]] bool count_urgent(const DeviceReading& device) noexcept;
  void send(const DeviceReading& device, Time now) noexcept;
  void ask_for_home(const DeviceReading& device, Time now) noexcept;

  DeviceDescription::Feel feel_;
  MachineName machine_name_;
  FarEnd far_end_;
  Link& link_;
  DeviceDriver driver_;
  DeviceKinematics kinematics_;
  SetPoint set_point_;
  JointWalls walls_;
  FeltLaw felt_;
  TorqueLimiter limiter_;
  EnergyPort energy_;

  double force_scale_;
  MasterSettings settings_;
  int steps_since_let_go_ = 0, home_steps_ = 0;
  SlaveMessageTap tap_;
  LinkInbox inbox_;
  LinkSession session_;
  std::optional<SlaveMessage> slave_;
  Time slave_at_ = kNever;  // arrival of slave_
  std::optional<MachineStatus> status_;
  std::optional<MachineReadings> readings_;
  Time status_at_ = kNever, first_heard_at_ = kNever;  // arrival of status_; of the first datagram of that machine
  Reason other_machine_;
  double round_trip_s_ = 0, silence_s_ = 1e9, lost_share_ = 0;
  bool heard_ = false;         // a round trip was measured
  bool may_ask_home_ = false;  // nothing asked for it when it was offered: a clutch held since before is no answer
  DevicePosture posture_;      // at the set-point
  PlanarVector law_force_N_ = PlanarVector::Zero(), rendered_N_ = PlanarVector::Zero();
  JointVector torque_Nm_ = JointVector::Zero();
  std::uint32_t sequence_ = 0, home_sequence_ = 0, stops_ = 0, releases_ = 0;
  bool leads_ = false, enabled_ = false, stopping_ = false;  // in the last step
  bool send_now_ = false;
  Datagram incoming_;
};

}  // namespace knuckle::master
