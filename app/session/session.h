// One teleoperation session on virtual time: operator, device, master, link, slave, bus and machine in lock-step, one
// millisecond a step, in one thread. Above the wires nothing knows that it is simulated.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/session/frame_log.h"
#include "app/session/scenario.h"
#include "app/session/session_record.h"
#include "core/histogram.h"
#include "machine/description.h"
#include "machine/device_description.h"
#include "recording/recorder.h"
#include "recording/sides.h"
#include "sim/haptic_device.h"
#include "sim/operator.h"
#include "sim/person.h"
#include "sim/truth.h"
#include "transport/impaired_link.h"
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

/// What a frame log must have room for: the full map, heartbeats and set-up dialogues of a session this long.
[[nodiscard]] std::size_t most_frames(const BusDescription& bus, double duration_s) noexcept;
/// An empty record of this session, with room for every row.
[[nodiscard]] SessionRecord start_record(const SessionSetup& setup);

/// Per-sample latencies; from the stamps that travel with each sample.
struct HopHistograms {
  Histogram hand_to_master;     ///< device report made -> report taken by the master
  Histogram master_to_slave;    ///< datagram sent -> taken by the slave loop
  Histogram hand_to_valve;      ///< device report -> set-point on the wire
  Histogram pressure_to_slave;  ///< pressure frame on the wire -> force estimated
  Histogram slave_to_master;    ///< datagram sent -> taken by the master
  Histogram pressure_to_hand;   ///< pressure frame on the wire -> torque report written
};

/// Of a session in which both sides are made of the same descriptions.
[[nodiscard]] recording::OperatorSetup operator_setup(const SessionSetup& setup);
/// Who acts out the scenario's plan.
[[nodiscard]] sim::Operator operator_of(const SessionSetup& setup);

class Session {
 public:
  /// @throws InputError where the setup does not fit together. Allocates all that steps need.
  explicit Session(const SessionSetup& setup);
  ~Session();

  /// Before the first step: all that its loops read, do and know goes there. @param recorder outlives this; whoever
  /// steps the session drains it.
  void record_to(recording::Recorder& recorder);

  /// One millisecond. Allocates nothing.
  void step() noexcept;
  [[nodiscard]] bool done() const noexcept;
  [[nodiscard]] double elapsed_s() const noexcept;
  /// Share of the scenario done, for progress: by phases.
  [[nodiscard]] double done_fraction() const noexcept;

  /// Judges faults from the recorded frames and hands the record over; the session is over then.
  [[nodiscard]] SessionRecord take_record();
  [[nodiscard]] const FrameLog& frames() const noexcept;
  [[nodiscard]] const HopHistograms& hops() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace knuckle::session
