// What a session is made of, and from options to it: files read, machine and limb sampled, everything checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/session/options.h"
#include "app/session/scenario.h"
#include "app/session/session_record.h"
#include "machine/description.h"
#include "machine/device_description.h"
#include "recording/head.h"
#include "recording/sides.h"
#include "sim/haptic_device.h"
#include "sim/operator.h"
#include "sim/person.h"
#include "sim/truth.h"
#include "transport/link_impairment.h"
#include "transport/link_session.h"

namespace knuckle::session {

struct SessionSetup {
  MachineDescription machine;  ///< As calibrated: all that the controller knows.
  DeviceDescription device;
  Scenario scenario;
  sim::MachineTruth truth;
  std::optional<sim::DeviceTruth> built_device;  ///< None: as its file says.
  sim::LimbImpedance limb;
  sim::Person person;  ///< Whose limb it is.
  std::vector<sim::PathPoint> path;
  LinkImpairment to_machine, to_operator;  ///< On virtual time.
  std::string listen = "127.0.0.1:0";      ///< On real time: the machine's end,
  std::string connect;                     ///< and where the operator's end sends to; empty: there.
  ControlLaw law = ControlLaw::kEchoSpring;
  std::uint64_t seed = 1, machine_seed = 1;
  /// What each end draws at its start; none: from the seed, so that the session repeats.
  struct Starts {
    LinkStart operator_end, machine_end;
  };
  std::optional<Starts> drawn_starts;
  [[nodiscard]] Starts starts() const {
    return drawn_starts.value_or(Starts{start_from(seed, LinkEnd::kOperator), start_from(seed, LinkEnd::kMachine)});
  }
  [[nodiscard]] sim::DeviceTruth device_truth() const { return built_device.value_or(device); }
};

struct LoadedSession {
  SessionSetup setup;
  std::string operator_name;       ///< Limb, or the recorded motion.
  std::vector<std::string> notes;  ///< What was done to the inputs.
  bool shortened = false;          ///< --duration ends it before the scenario would give it up.
};

/// @param follows_plan false: the hand is moved otherwise, and the inputs of the scenario's plan are not required.
/// @throws InputError for bad scenario, machine, device, map or motion files, or files that do not fit together.
[[nodiscard]] LoadedSession load_session(const SimulateOptions& options, bool follows_plan = true);

/// Of a session in which both sides are made of the same descriptions.
[[nodiscard]] recording::OperatorSetup operator_setup(const SessionSetup& setup);
/// Who acts out the scenario's plan.
[[nodiscard]] sim::Operator operator_of(const SessionSetup& setup);

/// What a frame log must have room for: the full map, heartbeats and set-up dialogues of a session this long.
[[nodiscard]] std::size_t most_frames(const BusDescription& bus, double duration_s) noexcept;
/// An empty record of this session, with room for every row.
[[nodiscard]] SessionRecord start_record(const SessionSetup& setup);

/// What a press should load the machine with: the force that the hand asks for, and the impact of the approach.
/// By phase of the plan: for a press, felt force over `force_scale` plus the impact v sqrt(k m): approach speed,
/// stiffness of what is pressed (the wall or ground that faces the press most), and the mass of a free arm at the part
/// of the bucket that is foremost, in the pose in which the press begins. 0 for all others: a press until something
/// breaks, or on a wall that is no linear spring, asks for no certain force.
[[nodiscard]] std::vector<double> asked_forces_N(const MachineDescription& machine, const Scenario& scenario,
                                                 double force_scale);

// What stands at the beginning of a recording.

/// Begun now. @param options that the set-up was made of.
[[nodiscard]] recording::Head session_head(const SessionSetup& setup, const SimulateOptions& options);

/// The operator's side alone, of a machine that is elsewhere. @param program with its arguments.
/// @param started_unix_ns of session time 0.
[[nodiscard]] recording::Head operator_head(const std::string& program, std::int64_t started_unix_ns,
                                            const MachineDescription& machine, const DeviceDescription& device,
                                            ControlLaw law, const LinkStart& start);

}  // namespace knuckle::session
