// The operator's side of a machine, simulated or not, behind the console's window: a haptic device or a simulated hand,
// the master loop, and what there is to be seen of both and of the link.
#pragma once

#include <cstdint>
#include <optional>

#include "app/console/console_view.h"
#include "app/console/hand_input.h"
#include "app/console/link_watch.h"
#include "app/session/session_sides.h"
#include "core/joints.h"
#include "core/time.h"
#include "machine/description.h"
#include "machine/device_description.h"
#include "master/device_kinematics.h"
#include "recording/recorder.h"
#include "recording/sides.h"
#include "sim/haptic_device.h"
#include "sim/operator.h"
#include "sim/person.h"
#include "transport/hid_port.h"
#include "transport/link.h"

namespace knuckle::console {

// The hand of a person at keyboard, gamepad or mouse, on a simulated haptic device: from the requested motion and what
// the screen shows to where the hand means to be. Above the device's wire nothing knows that it is not a real one.

class PersonHand {
 public:
  PersonHand(const DeviceDescription& device, const MachineDescription& machine,
             const sim::LimbImpedance& limb) noexcept;

  /// Every millisecond. The hand holds the device while the person is there. While enable is held and the machine is
  /// not led it goes to the machine's pose, as a person aligns by the picture; else it moves as requested, within the
  /// device's ranges, and pushes no harder than a hand does.
  /// @param scale machine joint radians per device joint radian.
  const sim::OperatorIntent& step(Time now, const HandInput& held, const sim::OperatorView& seen,
                                  double scale) noexcept;

 private:
  [[nodiscard]] JointVector aligning(const sim::OperatorView& seen, double scale) const noexcept;
  [[nodiscard]] JointVector moving(const HandInput& held, const sim::OperatorView& seen, double scale,
                                   double dt_s) noexcept;
  [[nodiscard]] JointVector within_reach(const JointVector& joint_rad, const JointVector& hand_rad) const noexcept;

  master::DeviceKinematics kinematics_;
  JointVector device_min_rad_, device_max_rad_, machine_min_rad_, machine_max_rad_;
  double most_ahead_m_;  // of the meant tip before the hand's: the limb's spring pushes no harder

  sim::OperatorIntent intent_;
  JointVector rate_radps_ = JointVector::Zero();  // of the requested machine pose, rounded off
  Time last_{}, took_hold_{};
};

struct StationSetup {
  recording::OperatorSetup side;
  // Of the simulated hand.
  sim::LimbImpedance limb;
  JointVector hand_rad = JointVector::Zero();   ///< At the start.
  JointVector start_rad = JointVector::Zero();  ///< Machine's pose as shown until it reports one.
  std::uint64_t seed = 1;
};

enum class ScalesAnswer : std::uint8_t { kAsTheyAre, kTaken, kLocked };

class OperatorStation {
 public:
  /// @param link, @param device outlive this. @param device nullptr: a simulated hand takes its place.
  OperatorStation(const StationSetup& setup, Link& link, HidPort* device);
  OperatorStation(const OperatorStation&) = delete;
  OperatorStation& operator=(const OperatorStation&) = delete;

  /// Before the first step: all that the operator's loop reads, does and knows goes there. @param recorder outlives the
  /// last step.
  void record_to(recording::Recorder& recorder) { side_.record_to(recorder); }

  /// One millisecond. Allocates nothing. @param held without effect with a haptic device.
  void step(Time now, const HandInput& held) noexcept;
  /// The same with a hand that knows where it means to be; simulated hand only.
  void step(Time now, const sim::OperatorIntent& intent) noexcept;

  void set_stop(bool pressed) noexcept { side_.master.set_stop(pressed); }
  void set_home(bool asked) noexcept { side_.master.set_home(asked); }
  void set_assist(const AssistSettings& assist) noexcept { side_.master.set_assist(assist); }
  /// 0: as the device's file says; what is beyond a bound is taken as the bound. Locked while
  /// the machine is led.
  ScalesAnswer set_scales(double position_scale, double force_scale) noexcept;
  /// While on, messages report the device as not held, whatever it reports itself.
  void set_nobody(bool on) noexcept { side_.master.set_nobody(on); }
  /// For the end: the device's torque off for good, and it counts as not held.
  void let_go() noexcept { side_.master.let_go(); }

  [[nodiscard]] bool has_device() const noexcept { return !hand_; }
  [[nodiscard]] const master::MasterLoop& master() const noexcept { return side_.master; }
  /// Simulated hand only.
  [[nodiscard]] const sim::HandTruth& hand() const noexcept { return hand_->device.truth(); }
  [[nodiscard]] const JointVector& start_rad() const noexcept { return start_rad_; }
  /// Puts in what the operator's side knows.
  void show(Time now, ConsoleView& view) noexcept;

 private:
  void step_master(Time now) noexcept;
  void show_link(Time now, LinkSide& link) noexcept;

  struct Scales {
    double position, force;
  };
  DeviceDescription::Feel feel_;
  Scales scales_;  // as taken
  JointVector start_rad_;
  std::optional<session::HandSide> hand_;
  PersonHand person_;
  LinkWatch watch_;
  recording::OperatorSide side_;
  LinkSide shown_;  // histograms are gathered a few times a second
  Time shown_at_ = kNever;
};

}  // namespace knuckle::console
