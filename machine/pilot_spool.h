// Where a spool is by the pressures that move it, where the machine measures these.
#pragma once

#include <algorithm>
#include <cmath>

#include "machine/description.h"

namespace knuckle {

/// Whether a machine that is led by frames tells the pilot pressures of this joint.
[[nodiscard]] inline bool tells_pilots(const BusDescription& bus, int joint) noexcept {
  return bus.broadcast(NodeRole::kPilot, 2 * joint).field != nullptr;
}
/// Of every joint: then all spools are told, as those of valve nodes are.
[[nodiscard]] inline bool tells_pilots(const BusDescription& bus) noexcept {
  return tells_pilots(bus, kBoom) && tells_pilots(bus, kArm) && tells_pilots(bus, kBucket);
}

/// The pressures push at the two ends of one spool, so that it goes by their difference: nothing moves by both at once,
/// nor by what the tank leaves in both lines.
class PilotSpool {
 public:
  /// @param machine tells_pilots() of this joint.
  PilotSpool(const MachineDescription& machine, int joint) noexcept
      : extend_(way(machine, joint, true)), retract_(way(machine, joint, false)) {}

  /// How far it lets oil through, [-1, 1]; positive extends.
  [[nodiscard]] double opening(double extend_Pa, double retract_Pa) const noexcept {
    const double push_Pa = extend_Pa - retract_Pa;
    return std::copysign(std::clamp(of(push_Pa).share(push_Pa), 0.0, 1.0), push_Pa);
  }
  /// Where it is, [-1, 1], as commands and dead bands have it: at its dead band where it begins to open.
  [[nodiscard]] double position(double extend_Pa, double retract_Pa) const noexcept {
    const double push_Pa = extend_Pa - retract_Pa;
    const Way& way = of(push_Pa);
    const double share = std::min(1.0, way.share(push_Pa));
    const double inside = way.shut_Pa > 0 ? std::abs(push_Pa) / way.shut_Pa : 0;
    return std::copysign(way.dead_band * (share > 0 ? 1 : inside) + (1 - way.dead_band) * std::max(0.0, share),
                         push_Pa);
  }

 private:
  struct Way {
    double shut_Pa = 0, full_Pa = 1, dead_band = 0;
    [[nodiscard]] double share(double push_Pa) const noexcept {
      return (std::abs(push_Pa) - shut_Pa) / (full_Pa - shut_Pa);
    }
  };
  static Way way(const MachineDescription& machine, int joint, bool extend) noexcept {
    const BroadcastField& field = *machine.bus.broadcast(NodeRole::kPilot, 2 * joint + (extend ? 0 : 1)).field;
    return {field.shut_Pa, field.full_Pa, machine.cylinders[static_cast<std::size_t>(joint)].valve.dead_band(extend)};
  }
  [[nodiscard]] const Way& of(double push_Pa) const noexcept { return push_Pa >= 0 ? extend_ : retract_; }

  Way extend_, retract_;
};

}  // namespace knuckle
