// A machine on a test bench: the simulated CANopen nodes on a virtual bus, cylinders that move as their spools open,
// and an operator's end of the link in the test's hand. No plant: pressures and loads are what the test says.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "machine/kinematics.h"
#include "machine/reason_text.h"
#include "sim/can_nodes.h"
#include "slave/slave_loop.h"
#include "tests/slave/lossy_can.h"
#include "tests/slave/reasons.h"
#include "tests/slave/test_machine.h"
#include "transport/can_buses.h"
#include "transport/canopen.h"
#include "transport/virtual_can.h"

namespace knuckle::test {

/// What the loop sends is kept decoded; what it receives the test puts in.
class ScriptedLink final : public Link {
 public:
  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    last_ = decode_slave(bytes);
    return true;
  }
  bool receive(Datagram& datagram) noexcept override {
    if (read_ == count_) return false;
    datagram = waiting_[read_++];
    return true;
  }
  /// Instead of all that waits.
  void deliver(const Datagram& datagram, Duration waited = {}) noexcept {
    read_ = count_ = 0;
    queue(datagram);
    waiting_[0].waited = waited;
  }
  /// Behind what waits.
  void queue(const Datagram& datagram) noexcept { waiting_.at(count_++) = datagram; }
  [[nodiscard]] const std::optional<SlaveMessage>& last() const noexcept { return last_; }

 private:
  std::optional<SlaveMessage> last_;
  std::array<Datagram, 4> waiting_;
  std::size_t read_ = 0, count_ = 0;
};

struct SentFrame {
  Time at;
  CanFrame frame;
};

/// Chamber pressures that carry the links at rest: without them the loop would take the bench for a contact.
inline std::array<double, 2 * kJoints> resting_pressures_Pa(const MachineDescription& machine,
                                                            const JointVector& joints_rad) {
  constexpr double kGravity_mps2 = 9.81, kRodSide_Pa = 20e5;
  const Kinematics kinematics(machine);
  JointVector joint_x_m, com_x_m;
  double x_m = 0, heading_rad = 0;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    heading_rad += joints_rad[i];
    joint_x_m[i] = x_m;
    com_x_m[i] = x_m + std::cos(heading_rad) * link.com_m.x() - std::sin(heading_rad) * link.com_m.y();
    x_m += std::cos(heading_rad) * link.length_m;
  }
  std::array<double, 2 * kJoints> pressure_Pa{};
  for (int i = 0; i < kJoints; ++i) {
    double torque_Nm = 0;
    for (int k = i; k < kJoints; ++k) {
      torque_Nm += machine.links[static_cast<std::size_t>(k)].mass_kg * kGravity_mps2 * (com_x_m[k] - joint_x_m[i]);
    }
    const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
    const double head_m2 = cylinder.head_area_m2(), rod_m2 = cylinder.rod_side_area_m2();
    const double force_N = torque_Nm / kinematics.cylinder_at(i, joints_rad[i]).value().lever_m;
    const double rod_Pa = std::max(kRodSide_Pa, kRodSide_Pa - force_N / rod_m2);
    pressure_Pa[static_cast<std::size_t>(2 * i)] = (force_N + rod_Pa * rod_m2) / head_m2;
    pressure_Pa[static_cast<std::size_t>(2 * i + 1)] = rod_Pa;
  }
  return pressure_Pa;
}

class BenchMachine {
 public:
  /// @param machine as its file has it @param own of the loop.
  explicit BenchMachine(const MachineDescription& machine = test_machine(), const LinkStart& own = {11, 1h})
      : description(calibrated(machine)), start(own) {
    wire.reserve(200000);
    bus.set_tap({[](void* context, Time at, const CanFrame& frame) {
                   auto& self = *static_cast<BenchMachine*>(context);
                   if (self.recording) self.wire.push_back({at, frame});
                 },
                 this});
    second.set_tap({[](void* context, Time at, const CanFrame& frame) {
                      auto& self = *static_cast<BenchMachine*>(context);
                      if (self.recording) self.wire.push_back({at, {frame.id | kSecondBus, frame.size, frame.data}});
                    },
                    this});
    const JointVector angle(0.3, -1.5, -0.8);
    for (int i = 0; i < kJoints; ++i) signals.cylinder_m[i] = kinematics.cylinder_at(i, angle[i]).value().length_m;
    signals.pressure_Pa = resting_pressures_Pa(description, angle);
    hand.device_ok = true;
    hand.position_rad = angle;
  }

  /// One millisecond; the loop steps every fifth, unless it hangs.
  void tick() {
    now += 1ms;
    ++ticks;
    plant();
    nodes.step(now, signals);
    bus.advance(now);
    second.advance(now);
    if (ticks % 5 != 0) return;
    if (link_up) {
      const std::uint32_t sequence = hand.stamp.sequence + 1;
      hand.stamp = {hand_session, start.session, sequence, now + master_clock, now - round_trip + start.origin};
      link.deliver(encode(hand), waited);
      if (home) {
        home->stamp = hand.stamp;
        home->stamp.sequence = ++home_sequence;
        home->stamp.sent_at -= home_held_up;
        link.queue(encode(*home));
      }
    }
    if (!hung) loop.step(now);
  }
  void run(Duration time) {
    for (const Time end = now + time; now < end;) tick();
  }
  /// Runs until the mode is reached; false after `patience`.
  bool reaches(Mode mode, Duration patience) {
    for (const Time end = now + patience; now < end;) {
      tick();
      if (loop.mode() == mode) return true;
    }
    return false;
  }
  /// Runs until all nodes are operational; false after 4 s.
  bool starts() {
    for (const Time end = now + 4s; now < end && !loop.client().operational();) tick();
    return loop.client().operational();
  }
  /// Runs until something is wrong with the bus or a node, for at most `patience`.
  Reason fails(Duration patience = 4s) {
    for (const Time end = now + patience; now < end && !loop.client().fault();) tick();
    return loop.client().fault();
  }
  /// The usual way in. The hand stays on the machine.
  bool engage() {
    hand.presence = true;
    hand.enable = false;
    if (!reaches(Mode::kReady, 4s) && loop.mode() != Mode::kFault) return false;
    run(20ms);
    hand.enable = true;
    align();
    return reaches(Mode::kEngaged, 1s);
  }
  void align() {
    hand.velocity_radps.setZero();
    hand.position_rad = angles();
  }
  [[nodiscard]] JointVector angles() const {
    JointVector angle;
    for (int i = 0; i < kJoints; ++i) angle[i] = kinematics.joint_at(i, signals.cylinder_m[i]).value();
    return angle;
  }
  /// Hand moves at a constant joint rate for a time, the set-point with it.
  void move(const JointVector& rate, Duration time) {
    hand.velocity_radps = rate;
    for (const Time end = now + time; now < end;) {
      hand.position_rad += rate * 1e-3;
      tick();
    }
  }
  [[nodiscard]] std::string fault() const { return text_with_code(loop.fault(), description.bus); }
  /// In a fault for this reason. @param subject where it matters
  [[nodiscard]] testing::AssertionResult faulted(ReasonCode code, std::optional<int> subject = std::nullopt) const {
    if (loop.mode() != Mode::kFault) return testing::AssertionFailure() << "in mode " << static_cast<int>(loop.mode());
    return is(loop.fault(), code, subject);
  }
  [[nodiscard]] std::string setup_failure() const { return text(loop.client().setup_failure(), description.bus); }
  /// No spool lets oil through.
  [[nodiscard]] bool closed() const {
    return (signals.spool.array().abs() < description.cylinders[kBoom].valve.dead_band_extend).all();
  }
  [[nodiscard]] std::vector<CanFrame> frames(std::uint32_t id) const {
    std::vector<CanFrame> found;
    for (const auto& w : wire) {
      if (w.frame.id == id) found.push_back(w.frame);
    }
    return found;
  }
  /// First time from `since` on at which the valve was commanded neutral and stayed so until now; kNever if not.
  [[nodiscard]] Time command_neutral_since(Time since, int joint) const {
    Time neutral = kNever;
    for (const auto& w : wire) {
      if (w.frame.id != canopen::rpdo1_id(description.bus.valve(joint).id)) continue;
      const auto command = canopen::parse_valve_command(w.frame);
      const bool is = command && (command->set_point == 0 || command->control_word != canopen::kControlActive);
      if (!is) neutral = kNever;
      if (is && neutral == kNever) neutral = std::max(w.at, since);
    }
    return neutral;
  }

  MachineDescription description;
  Kinematics kinematics{description};
  // Ports: the controller's, the nodes', and a stranger's. The second may have none.
  VirtualCanBus bus{3, description.bus.bit_rate}, second{3, description.bus.second.value_or(BusLine()).bit_rate};
  CanBuses nodes_end{bus.port(1), &second.port(1)}, controllers_end{bus.port(0), &second.port(0)};
  sim::CanNodes nodes{description, errors(), nodes_end, 1};
  LossyCan can{controllers_end};  ///< The controller's end.
  ScriptedLink link;
  LinkStart start;
  slave::SlaveLoop loop{description, can, link, start};
  sim::MachineSignals signals;
  MasterMessage hand;
  std::optional<HomeMessage> home;  ///< Said beside it.
  std::uint32_t home_sequence = 0;
  Duration home_held_up{};  ///< On its way.
  Time now{10s};
  long ticks = 0;
  bool link_up = true, hung = false, recording = true;
  Duration round_trip = 20ms;
  Duration master_clock{};  ///< Of the operator's side, against ours.
  Duration waited{};        ///< Of its messages, in the kernel of the machine's side.
  std::uint64_t hand_session = 5;
  PerJoint<bool> blocked{};                  ///< The cylinder does not move whatever its valve does.
  PerJoint<std::optional<double>> jammed{};  ///< The spool stays there, with and without pilot pressure.
  std::vector<SentFrame> wire;

 private:
  static sim::SensorErrors errors() {
    sim::SensorErrors e;
    e.pressure_noise_Pa.fill(0.3e5);
    return e;
  }
  /// Spool: first-order, 20 ms. Cylinder: nominal flow at the load-sensing margin over its area.
  void plant() {
    const sim::NodeOutputs out = nodes.outputs();
    for (int i = 0; i < kJoints; ++i) {
      const auto joint = static_cast<std::size_t>(i);
      const CylinderDescription& c = description.cylinders[joint];
      const double demand = out.pilot ? out.spool_demand[i] : 0;
      signals.spool[i] = jammed[joint].value_or(signals.spool[i] + (demand - signals.spool[i]) * 0.05);
      const double band = c.valve.dead_band_extend;
      const double opening = std::max(0.0, std::abs(signals.spool[i]) - band) / (1 - band);
      const double speed = std::copysign(opening * c.valve.nominal_flow_m3ps / c.head_area_m2(), signals.spool[i]);
      signals.cylinder_mps[i] = blocked[joint] ? 0 : speed;
      signals.cylinder_m[i] =
          std::clamp(signals.cylinder_m[i] + signals.cylinder_mps[i] * 1e-3, c.min_length_m, c.max_length_m);
      signals.shaft_rad[i] = kinematics.joint_at(i, signals.cylinder_m[i]).value_or(signals.shaft_rad[i]);
      if (const auto cylinder = kinematics.cylinder_at(i, signals.shaft_rad[i])) signals.lever_m[i] = cylinder->lever_m;
    }
  }
};

}  // namespace knuckle::test
