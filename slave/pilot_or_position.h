// Which sensor is wrong where a joint's position contradicts the pilot pressures that move its spool: each tells of the
// other.
#pragma once

#include <array>
#include <cstdint>

#include "core/joints.h"
#include "machine/description.h"

namespace knuckle::slave {

/// What moves the spools: what the joints were told, and the pressures, where the machine measures them.
struct Piloting {
  JointVector demand = JointVector::Zero();  ///< As on the wire, [-1, 1].
  std::array<double, 6> pressure_Pa{};       ///< By SignalInfo::index.
};

/// Told by what the joint was asked to do: the one of the two that agrees with that is right. text(Reason) says of
/// either that it may be the other.
class PilotOrPosition {
 public:
  PilotOrPosition(const MachineDescription& machine, double step_s);
  /// There is no reset: what was asked stays true when what Plausibility has seen of the sensors is forgotten.
  void step(const Piloting& piloting) noexcept;
  // What a reason is about. Of a joint without pilot pressures it is the position sensor.
  /// The spool is open, and the cylinder is not seen to move. @param direction of the opening, as of those below
  [[nodiscard]] std::uint8_t of_open(int joint, int direction) const noexcept;
  /// The spool is shut, and the cylinder moves. A joint that was asked to is right.
  [[nodiscard]] std::uint8_t of_shut(int joint, int direction) const noexcept;

 private:
  struct Line {
    std::uint8_t subject = 0;
    double shut_Pa = 0, pressure_Pa = 0;
    double least_asked = 0;  ///< Of the full command: less opens nothing.
    double unasked_s = 0;
  };
  struct Axis {
    bool told = false;  ///< The pressures of its spool.
    std::uint8_t position = 0;
    std::array<Line, 2> lines{};  ///< Retracting, extending.
  };
  PerJoint<Axis> axes_{};
  double step_s_;
};

}  // namespace knuckle::slave
