// Small motions of one valve at a time, before sensors and signs are checked: commands are open loop, and a gate of
// their own, which needs no joint angles, ends every motion that differs from its plan.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/joints.h"
#include "core/time.h"
#include "machine/description.h"
#include "slave/canopen_client.h"
#include "slave/node_setup.h"
#include "transport/bus_access.h"

namespace knuckle::bringup {

/// Newest values as the nodes report them: not zeroed, not filtered, none left out.
struct RawSensors {
  std::array<double, 6> pressure_Pa{};
  JointVector length_m = JointVector::Zero();
  double tilt_rad = 0;
  std::array<Time, 10> at{};               ///< Arrivals: pressures, lengths, tilt; kNever before the first.
  std::array<bool, 6> pressure_invalid{};  ///< As reported by the transmitter.
  [[nodiscard]] Time oldest() const noexcept;
  [[nodiscard]] bool invalid() const noexcept;
};

struct JogPlan {
  int joint = 0;
  double peak = 0;         ///< Command that is not exceeded, fraction of spool stroke; its sign is the direction.
  double rise_1ps = 0.05;  ///< The command's slope up to there.
  double travel_m = 0.02;  ///< Ends after so much motion of its own encoder.
  double longest_s = 10;
  bool until_stall = false;  ///< Ends where the cylinder, having moved, stands still against the open valve.
};
struct JogSample {
  double t_s = 0, command = 0, spool = 0;  ///< Of the joint that moves.
  JointVector length_m = JointVector::Zero();
  std::array<double, 6> pressure_Pa{};
};
struct JogRun {
  enum class End : std::uint8_t { kTravelled, kStalled, kTime } end = End::kTime;
  JogPlan plan;
  std::vector<JogSample> samples;  ///< One a SYNC, from the first command on.
  [[nodiscard]] JointVector travelled_m() const { return samples.back().length_m - samples.front().length_m; }
};

/// Limits of such motions, in no file.
struct JogLimits {
  double command = 0.35;         ///< Of spool stroke: a slow motion on any machine.
  double other_travel_m = 0.01;  ///< Of a cylinder that was not commanded.
  double longest_s = 90;
};
inline constexpr JogLimits kJogLimits{};

/// What such a motion is judged by.
struct JogState {
  double command = 0;  ///< About to be sent.
  double elapsed_s = 0;
  double other_travel_m = 0;  ///< Largest of the cylinders not commanded, and ...
  int other_joint = 0;        ///< ... which.
  std::array<double, 6> pressure_Pa{};
  Duration oldest{};  ///< Age of the oldest sensor value.
  bool invalid = false;
  bool e_stop_open = false;
};
/// What ends a motion at once, in one line; empty while it may go on. It does not trust the plan.
[[nodiscard]] std::string jog_gate(const JogState& state, const MachineDescription& machine);

class JogBench {
 public:
  /// @param stopped whether the operator requests a stop; called every SYNC while something moves.
  JogBench(const MachineDescription& machine, BusAccess& access, std::function<bool()> stopped);

  /// Configures and starts all nodes; pilot pressure stays off. @throws CommissionEnded where one does not come up.
  void start();
  /// One SYNC period, neutral and without pilot pressure. @throws CommissionEnded where a node fails.
  void idle();
  void idle(Duration time);
  /// Pilot pressure on with closed valves for so long; off again after it.
  /// @return how far each cylinder has crept. @throws CommissionEnded
  [[nodiscard]] JointVector try_pilot(Duration time);
  /// Pilot pressure on, the motion, neutral, pilot pressure off. @throws CommissionEnded with the reason where the
  /// gate, a node or a person ended it.
  [[nodiscard]] JogRun run(const JogPlan& plan);
  /// Works through SDO steps of one node meanwhile. @throws CommissionEnded where it refuses.
  void write_objects(std::uint8_t node, slave::SdoScript script);

  [[nodiscard]] const RawSensors& sensors() const noexcept { return sensors_; }
  [[nodiscard]] const slave::CanopenClient& client() const noexcept { return client_; }
  /// Neutral and pilot pressure off, whatever happened before; for the way out.
  void neutral() noexcept;

 private:
  /// Until the next SYNC period, then receives. What is sent next is judged by these values.
  void wait();
  void send(const JointVector& commands, bool pilot);
  void rest(bool pilot);
  void hear(const CanFrame& frame) noexcept;
  void require_pilot(bool on);
  void close();
  [[nodiscard]] JogSample sample(const JogPlan& plan, double t_s, double command) const;
  void guard(const JogPlan& plan, const JogSample& first, const JogSample& next) const;

  MachineDescription machine_;
  BusAccess& access_;
  std::function<bool()> stopped_;
  slave::CanopenClient client_;
  canopen::PressureFormat pressure_format_;
  Duration period_;
  Time due_{};
  RawSensors sensors_;
  std::optional<slave::SdoDialogue> telling_;
};

}  // namespace knuckle::bringup
