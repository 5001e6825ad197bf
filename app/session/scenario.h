// A scenario file: where everything stands, what the operator does, which faults occur, and the criteria of the
// session.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/session/metrics.h"
#include "core/joints.h"
#include "core/time.h"
#include "machine/description_fwd.h"
#include "sim/machine_faults.h"
#include "sim/operator.h"
#include "sim/person.h"
#include "sim/world.h"
#include "transport/link_messages.h"

namespace knuckle::session {

/// Of the link, one way: of its delay and of its jitter.
inline constexpr double kLongestDelay_ms = 5000;
/// Bounds of the assist's force limit: below, the estimate is not good enough to hold it; above, it limits nothing.
inline constexpr double kLeastAssist_N = 300, kMostAssist_N = 1e5;

/// What is broken while a phase runs.
struct ScheduledFault {
  sim::FaultKind kind = sim::FaultKind::kLinkCut;
  int phase = 0;          ///< Index of the operator's phase in which it happens.
  double after_s = 0;     ///< Into that phase.
  double duration_s = 0;  ///< Then it is mended.
  int subject = 0;        ///< Id of the node, which of two buses, or sim::frame_subject(); 0 where it is about none.
};

struct Scenario {
  std::string name, description, source, text;  ///< The last two: the file it was read from, and its text.
  JointVector start_rad = JointVector::Zero();  ///< Machine at the start.
  JointVector hand_rad = JointVector::Zero();   ///< Hand at the start.
  sim::LimbClass limb = sim::LimbClass::kNormal;
  sim::PersonClass person = sim::PersonClass::kExact;
  Duration reaction = 200ms;
  double delay_ms = 1;      ///< Link, one way, unless the command line says otherwise.
  double duration_s = 120;  ///< Given up after this long.
  std::vector<sim::Phase> phases;
  std::vector<std::string> phase_names;
  sim::WorldDescription world;
  std::vector<ScheduledFault> faults;
  AssistSettings assist;            ///< Switched on all the time, unless the command line says otherwise.
  std::vector<Criterion> criteria;  ///< Of every kind, in the order of CriterionKind.
};

/// Lengths in the file are for a reach of `reference_reach_m` (links added up) and are scaled to this machine's; loads
/// (masses, break forces) with its payload; bounds on what is measured at the machine likewise. docs/scenarios.md has
/// every key.
/// @throws InputError naming file, line, key, value and bound; also for a pose that this machine cannot take.
[[nodiscard]] Scenario load_scenario(const std::string& path, const MachineDescription& machine);
/// The same for a file's text. @param source names it in messages.
[[nodiscard]] Scenario parse_scenario(std::string_view text, const std::string& source,
                                      const MachineDescription& machine);

/// For whoever runs it in real time. @param how it must be run, after "knuckle simulate".
/// @throws InputError where it schedules faults, which would never happen.
void refuse_faults(const Scenario& scenario, const std::string& how = "");
/// For a person's hand. @throws InputError where a press asks for more than such a hand holds.
void check_strength(const Scenario& scenario, sim::LimbClass limb);
/// Its own operator's plan needs a recording.
[[nodiscard]] bool follows_recording(const Scenario& scenario);

}  // namespace knuckle::session
