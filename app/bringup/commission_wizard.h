// The commissioning of a machine, step by step with a person, from identity to dead bands: every step is announced,
// nothing moves before it is confirmed, and a fault ends it with the machine neutral.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/bringup/commission_bus.h"
#include "app/bringup/commission_dialogue.h"
#include "app/bringup/commission_guards.h"
#include "app/bringup/commission_jog.h"
#include "app/bringup/doctor_bus.h"
#include "machine/description.h"
#include "transport/bus_access.h"

namespace knuckle::bringup {

struct AxisResult {
  std::optional<double> stroke_m;  ///< Between its stops.
  std::optional<double> offset_m;  ///< Reading minus the pin-to-pin length, before any preset.
  bool preset = false;             ///< The encoder was made to show the pin-to-pin length, or the file says its zero.
  std::optional<double> dead_band_extend, dead_band_retract;
  /// Of a joint whose frame the machine sends by itself: added to what the file makes of it, m or rad.
  std::optional<double> zero_shift{};

  /// As they are called where they are kept.
  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    visit("stroke_m", s.stroke_m);
    visit("offset_m", s.offset_m);
    visit("preset", s.preset);
    visit("zero_shift", s.zero_shift);
    visit("dead_band_extend", s.dead_band_extend);
    visit("dead_band_retract", s.dead_band_retract);
  }
};
struct WizardResult {
  std::vector<NodeLine> nodes;
  std::optional<double> tilt_error_rad;  ///< Reading minus the spirit level; nullopt where not compared.
  std::vector<GuardResult> guards;
  PerJoint<AxisResult> axes;
  Findings findings;
  std::vector<std::string> recordings;  ///< Files for `knuckle identify`.
};

/// The steps that need not be made again by a run that goes on where another has ended. Those before are made in each
/// run: they prove bus, E-stop, closed valves and signs as they are now, whatever was repaired in between.
inline constexpr int kStrokes = 5, kDeadBands = 6;
struct WizardProgress {
  int completed = 0;                              ///< The last completed step; below kStrokes: none of them.
  std::map<std::uint8_t, std::uint32_t> serials;  ///< Of the nodes that have a serial number, by id.
  PerJoint<AxisResult> axes;
  Findings findings;  ///< Of these steps.
};
/// What an earlier run has found no longer holds: there is nothing to go on with.
class ProgressLost : public CommissionEnded {
 public:
  using CommissionEnded::CommissionEnded;
};
/// Where to go on, and who keeps how far it came: told after each of these steps.
struct Resume {
  WizardProgress from;
  std::function<void(const WizardProgress&)> keep;
};

/// @param record drives and records motion in closed loop with the values measured so far, once confirmed.
/// @return its files. @param check called all the time; may throw to end it.
/// @throws CommissionEnded where it did not come to its end; the machine is neutral then.
[[nodiscard]] WizardResult run_wizard(
    const MachineDescription& machine, BusAccess& access, Partner partner,
    const std::function<std::vector<std::string>(const MachineDescription&, const std::function<bool()>& stopped)>&
        record,
    const std::function<void()>& check, const Resume& resume = {});

}  // namespace knuckle::bringup
