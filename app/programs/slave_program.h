// The machine's side as a program: the slave loop of every session in a real-time thread of its own, what it did and
// why on the console, records where requested, and an orderly end.
#pragma once

#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "app/programs/program_console.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "recording/recorder.h"
#include "slave/emergency_log.h"
#include "slave/node_setup.h"
#include "transport/can_bus.h"
#include "transport/link.h"
#include "transport/link_messages.h"
#include "transport/link_session.h"
#include "transport/machine_readings.h"

namespace knuckle::programs {

/// Mode or latched fault changed, or the operator chose to go home on two.
struct ModeEvent {
  Time at{};
  Mode mode = Mode::kOff;
  Reason blocking, fault;
  bool home_on_two = false;  ///< From then on true.
};
/// "engaged", "aligning, hand_not_aligned: arm: hand is away ...", "fault link_lost: no newer packet ..."
[[nodiscard]] std::string event_text(const ModeEvent& event, const BusDescription& bus);

/// Where records go; null: not wanted.
struct SlaveRecords {
  std::ostream* candump = nullptr;          ///< Every frame sent and received, candump log format.
  std::string interface = "can0";           ///< As the log names it, ...
  std::string second_interface = "can1";    ///< ... and of two buses the second.
  std::ostream* csv = nullptr;              ///< A row each step from the first complete measurement on.
  recording::Recorder* recorder = nullptr;  ///< All that the loop reads, knows and does, and events; outlives the run.
  bool simulated = false;                   ///< There is no real machine on the bus.
  // Called by the thread that tends the loop; may be empty.
  std::function<void(const ModeEvent&)> on_mode{};
  /// Every 20 ms, once heard.
  std::function<void(Time now, Time heard_at, Duration round_trip, bool silent)> on_link{};
  std::function<void(const AssistSettings&)> on_assist{};  ///< The operator has set other assists than before.
};

/// The set-up of a node failed: the request and its answer.
struct SetupFailureEvent {
  Time at{};
  slave::SetupFailure failure;
};

struct SlaveOutcome {
  /// All of one node with the same code.
  struct Emergency {
    slave::EmergencyRecord first;
    std::uint64_t times = 1;
    Time last_at = kNever;
  };
  static constexpr std::size_t kMostEmergencies = 256;
  std::vector<ModeEvent> events;  ///< The first of each kind, and the newest others (RunEvents); so are the next two.
  std::vector<ModeEvent> faults;  ///< Another fault than before.
  std::vector<SetupFailureEvent> setup_failures;
  std::vector<Emergency> emergencies;
  RealtimeReport loop;
  double ran_s = 0;
  MachineReadings readings;  ///< As told at the end.
  std::uint32_t malformed_datagrams = 0;
  std::uint64_t records_lost = 0;  ///< Frames, rows, events, set-up failures, emergencies: no room for them.
  bool commanded = true;           ///< False where nothing was sent, as the machine was somebody else's all the time.
  bool by_frames = false;          ///< The machine's own controller was told by command frames.
  std::vector<std::string> unconfirmed;  ///< Nodes and frames that did not say that all is off, by their names.
  [[nodiscard]] bool stop_confirmed() const noexcept { return commanded && unconfirmed.empty(); }
  /// @return whether it is the first of its node and code. Beyond kMostEmergencies such kinds it is lost, and counted.
  bool add(const slave::EmergencyRecord& record);
};

/// Runs until the run is over, then stops in order: neutral, pilot pressure and valves off, then silence. What it has
/// never commanded it does not stop: that is somebody else's machine.
/// @param machine as calibrated. @param bus, @param link used by the loop's thread alone while this runs.
/// @throws InputError where the machine file cannot be worked with.
/// @param start drawn anew for each run.
[[nodiscard]] SlaveOutcome run_slave(const MachineDescription& machine, CanBus& bus, Link& link, const LinkStart& start,
                                     const ProgramRun& run, const SlaveRecords& records = {});

}  // namespace knuckle::programs
