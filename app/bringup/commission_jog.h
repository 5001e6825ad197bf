// Commissioning's use of slave/jog.h, which drives and guards the valves: waits SYNC period by period, in real or
// virtual time, until a task is done, keeps its samples, and says in words why it ended early.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/bringup/doctor_finding.h"
#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/description.h"
#include "slave/jog.h"
#include "slave/node_setup.h"
#include "transport/bus_access.h"

namespace knuckle::bringup {

struct JogRun {
  slave::JogEnd end = slave::JogEnd::kTime;
  slave::JogPlan plan;
  std::vector<slave::JogSample> samples;  ///< One a SYNC, from the first command on.
  [[nodiscard]] JointVector travelled_m() const { return samples.back().length_m - samples.front().length_m; }
};

/// What a module's outputs did while what its guard waits for was withheld.
struct OutputsTried {
  slave::GuardSeen seen;
  JogRun run;
};

/// What ended a task early, in one line for the person who commissions.
[[nodiscard]] std::string jog_text(const Reason& reason, const BusDescription& bus);

/// Valves disabled and pilot pressure off, whatever happened before. @return what became of it, in a line.
/// @param has_address command frames may go out from the J1939 address, where some do
[[nodiscard]] std::string take_out_of_service(const MachineDescription& machine, BusAccess& access,
                                              bool has_address = true);

class JogBench {
 public:
  /// @param stopped whether the operator requests a stop; called every SYNC while a task is under way.
  JogBench(const MachineDescription& machine, BusAccess& access, std::function<bool()> stopped);

  /// Configures and starts all nodes; pilot pressure stays off. @throws CommissionEnded where one does not come up.
  void start();
  /// One SYNC period, neutral and without pilot pressure. @throws CommissionEnded where a node fails.
  void idle();
  void idle(Duration time);
  /// Pilot pressure on with closed valves for so long; off again after it.
  /// @return how far each cylinder has crept. @throws CommissionEnded
  [[nodiscard]] JointVector try_pilot(Duration time);
  /// The same for two seconds. @throws CommissionEnded where a cylinder moves although all valves are closed.
  void prove_closed();
  /// Pilot pressure on, the motion, neutral, pilot pressure off. @throws CommissionEnded with the reason where the
  /// gate, a node or a person ended it.
  [[nodiscard]] JogRun run(const slave::JogPlan& plan);
  /// Withholds from a valve, or from the enable node, what its guard waits for (Jog::try_guard), and starts all nodes
  /// anew. @throws CommissionEnded
  [[nodiscard]] slave::GuardSeen try_guard(const BusDescription& bus, const NodeDescription& node, int joint);
  /// Moves a cylinder by the outputs of a module, withholds what that waits for (Jog::try_outputs), and starts all
  /// nodes anew. @throws CommissionEnded
  [[nodiscard]] OutputsTried try_outputs(const BusDescription& bus, const NodeDescription& module,
                                         const slave::JogPlan& plan);
  /// Works through SDO steps of one node meanwhile. @throws CommissionEnded where it refuses.
  void write_objects(std::uint8_t node, slave::SdoScript script);

  [[nodiscard]] const slave::RawSensors& sensors() const noexcept { return jog_.sensors(); }
  [[nodiscard]] const slave::CanopenClient& client() const noexcept { return jog_.client(); }
  [[nodiscard]] bool tells_e_stop() const noexcept { return jog_.tells_e_stop(); }
  [[nodiscard]] std::optional<bool> e_stop_open() const noexcept { return jog_.e_stop_open(); }
  [[nodiscard]] bool may_command() const noexcept { return jog_.may_command(); }
  /// What nodes have told since the last call, each text once. @param expected and is not worth telling
  [[nodiscard]] std::vector<std::string> emergencies(
      const std::function<bool(const slave::EmergencyRecord&)>& expected = {});
  /// @throws CommissionEnded where a sensor sends a value that cannot be.
  void check_values() const;
  /// Neutral and pilot pressure off, whatever happened before; for the way out.
  void neutral() noexcept;

 private:
  /// Until the next SYNC period, then the jog's step.
  void step();
  /// Likewise, within a task that a person may stop.
  void go_on();
  /// Of nodes that wait for the heartbeat as well.
  [[nodiscard]] std::vector<std::uint8_t> others_waiting(const BusDescription& bus, const NodeDescription& node) const;
  /// The task, while the others wait longer for the heartbeat where that is what the node waits for.
  /// @return false where they cannot: then it was not begun.
  bool alone(const BusDescription& bus, const NodeDescription& node, bool in_motion, const std::function<void()>& task);
  void follow(JogRun& run);
  void restore(std::uint8_t node, slave::SdoScript script) noexcept;

  BusAccess& access_;
  std::function<bool()> stopped_;
  slave::Jog jog_;
  Duration period_;
  Time due_{};
  std::uint64_t emergencies_told_ = 0;
};

// Judges sensors, sides, stroke ends and valve of one axis from its motions. Pure functions of recorded samples.

/// Of a joint, as findings and questions name it.
[[nodiscard]] inline const char* axis_name(int joint) {
  return kJointNames[static_cast<std::size_t>(joint)];
}

/// What a person saw the cylinder do.
enum class Seen : std::uint8_t { kLonger, kShorter, kStill, kAnother };

/// Encoder and valve of an axis after a motion that was to extend, or retract, it.
[[nodiscard]] Finding judge_direction(const JogRun& run, Seen seen, const BusDescription& bus);

/// A hull's slope against a spirit level's.
[[nodiscard]] Finding judge_tilt(double reading_rad, double level_rad);

/// The axis at one end of its stroke, its valve still open.
struct StrokeEnd {
  double reading_m = 0;
  std::array<double, 6> rise_Pa{};  ///< Of every chamber, against before the motion.
};
/// nullopt where the run did not end at a stop.
[[nodiscard]] std::optional<StrokeEnd> stroke_end(const JogRun& run);
/// At a stop the driven chamber must have risen more than any other. @param extended which end.
[[nodiscard]] Finding judge_sides(const StrokeEnd& end, int joint, bool extended);

/// The machine file's key of how much a step of this joint's encoder is.
[[nodiscard]] const char* step_key(const MachineDescription& machine, int joint) noexcept;

/// Between both stops. A linkage may stop before the cylinder does, but not inside the joint's working range; further
/// than the cylinder goes nothing does.
[[nodiscard]] Finding judge_stroke(double stroke_m, int joint, const MachineDescription& machine);

/// Dead band from a slow ramp: behind it flow grows with the opening, and the opening with time, so the way grows with
/// the square of the time since the edge: sqrt(way) is a line whose root is the edge. The spool lags the command by the
/// file's delay and its second order (2 zeta / omega).
/// @return fraction of stroke; nullopt where the ramp did not move it far enough.
[[nodiscard]] std::optional<double> dead_band(const JogRun& ramp, const ValveDescription& valve);
/// Whether it is further from the file's than a slow ramp may be wrong.
[[nodiscard]] bool dead_band_differs(double found, double file) noexcept;
[[nodiscard]] Finding judge_dead_band(const std::optional<double>& found, double file, int joint, int direction);

}  // namespace knuckle::bringup
