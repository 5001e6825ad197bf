// The pilot valves of a machine that is told by frames: one at each end of a spool, and the pressures that they make,
// as the machine measures them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/joints.h"
#include "machine/description.h"

namespace knuckle::sim {

enum class PilotFault : std::uint8_t {
  kNone,
  kStuck,   ///< Its pressure stays as long as the pilot pump feeds it.
  kBroken,  ///< The line lost its oil: no pressure comes.
};

class PilotStage {
 public:
  /// @param machine shut_Pa, full_Pa and dead bands are those that it really has.
  explicit PilotStage(const MachineDescription& machine) {
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      const BroadcastField* const field = machine.bus.broadcast(NodeRole::kPilot, static_cast<int>(i)).field;
      lines_[i].dead_band = machine.cylinders[i / 2].valve.dead_band(i % 2 == 0);
      if (field == nullptr) continue;
      lines_[i].shut_Pa = field->shut_Pa;
      lines_[i].full_Pa = field->full_Pa;
    }
  }
  void inject(int joint, bool extend, PilotFault fault) noexcept {
    lines_[static_cast<std::size_t>(2 * joint + (extend ? 0 : 1))].fault = fault;
  }

  /// @param demand of the spools, [-1, 1] @param fed by the pilot pump.
  void step(const JointVector& demand, bool fed, double step_s) noexcept {
    constexpr double kLag_s = 0.02;
    const double share = 1 - std::exp(-step_s / kLag_s);
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      Line& line = lines_[i];
      const double asked = std::max(0.0, (i % 2 == 0 ? 1 : -1) * demand[static_cast<int>(i / 2)]);
      const bool stays = line.fault == PilotFault::kStuck && fed;
      const double target = fed && line.fault != PilotFault::kBroken ? asked : 0;
      if (!stays) line.stroke += share * (target - line.stroke);
    }
  }
  /// What the spools are driven to: as demanded, but where a pilot valve fails. The lag of sound ones is in the
  /// valves'.
  [[nodiscard]] JointVector driven(const JointVector& demand) const noexcept {
    JointVector driven;
    for (int joint = 0; joint < kJoints; ++joint) {
      const auto end = [&](std::size_t line, double asked) {
        return lines_[line].fault == PilotFault::kNone ? std::max(0.0, asked) : lines_[line].stroke;
      };
      const auto extend = static_cast<std::size_t>(2 * joint);
      driven[joint] = end(extend, demand[joint]) - end(extend + 1, -demand[joint]);
    }
    return driven;
  }
  /// @param line SignalInfo::index
  [[nodiscard]] double pressure_Pa(int line) const noexcept {
    const Line& of = lines_[static_cast<std::size_t>(line)];
    if (of.stroke <= of.dead_band) return of.dead_band > 0 ? of.shut_Pa * of.stroke / of.dead_band : 0;
    return of.shut_Pa + (of.full_Pa - of.shut_Pa) * (of.stroke - of.dead_band) / (1 - of.dead_band);
  }

 private:
  struct Line {
    double shut_Pa = 0, full_Pa = 0, dead_band = 0;
    double stroke = 0;  ///< That its pressure drives the spool to.
    PilotFault fault = PilotFault::kNone;
  };
  std::array<Line, 2 * kJoints> lines_{};
};

}  // namespace knuckle::sim
