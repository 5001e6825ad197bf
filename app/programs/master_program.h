// The operator's side as a program, without a screen: the master loop of every session in a real-time thread of its
// own, what the machine and the device say on the console, and an end that releases both.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/programs/program_console.h"
#include "core/histogram.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "recording/recorder.h"
#include "recording/sides.h"
#include "transport/hid_port.h"
#include "transport/link.h"
#include "transport/link_messages.h"
#include "transport/machine_readings.h"
#include "transport/machine_status.h"

namespace knuckle::programs {

/// The machine's report changed (mode or fault, or that packets are received at all), or the device's state, or whether
/// both sides mean the same machine, or whether less is felt than the machine feels.
struct MasterEvent {
  enum class About : std::uint8_t { kMachine, kDevice, kSameMachine, kFelt } about = About::kMachine;
  Time at{};
  bool heard = false;  ///< The machine, within the last second.
  Mode mode = Mode::kOff;
  Reason blocking, fault;                          ///< Machine.
  bool home_offered = false, home_on_two = false;  ///< Likewise.
  Reason device;                                   ///< Why the device cannot be used; kNone where it can.
  Reason other_machine;                            ///< Why the far end cannot be led; kNone where it can.
  Reason warning;  ///< Why less is felt: energy watchdog or cues; kNone: the law's force is felt in full.
  MachineName here, there;
};
/// "machine engaged", "machine: no packets received", "device device_lost: ...", "other_machine: ...",
/// "felt force: cues_delay: ..." @param bus of the machine; an empty one where it is not known.
[[nodiscard]] std::string event_text(const MasterEvent& event, const BusDescription& bus);

struct MasterOutcome {
  std::vector<MasterEvent> events;              ///< The first of each kind, and the newest others (RunEvents).
  bool device_was_ready = false;                ///< At any time.
  bool machine_was_heard = false;               ///< Likewise.
  Histogram round_trip;                         ///< As measured; one value each step while packets are received.
  std::optional<MachineStatus> machine_status;  ///< The newest; nothing where the machine's side sent none.
  MachineReadings readings;                     ///< The newest.
  RealtimeReport loop;
  double ran_s = 0;
  std::uint64_t records_lost = 0;  ///< Events and rows there was no room for.
};

/// Going home on two, from outside the loop.
struct HomeRequest {
  std::atomic<bool> asked{false};    ///< Set by whoever asks; taken by the program.
  std::atomic<bool> offered{false};  ///< By the machine, as the program has heard.
};

/// Runs until the run is over; then releases: enable and presence off, torque off, and ends.
/// @param port, @param link used by the loop's thread alone while this runs.
/// @param device_problem what is wrong with the device below the loop, in one line; empty: nothing. May be empty
/// itself.
/// @param csv a row every 5 ms; null: not wanted.
/// @param recorder all that the loop reads, knows and does, and events; null: not wanted.
/// @param home null: nobody asks.
[[nodiscard]] MasterOutcome run_master(const recording::OperatorSetup& setup, HidPort& port, Link& link,
                                       const ProgramRun& run, const std::function<std::string()>& device_problem = {},
                                       std::ostream* csv = nullptr, recording::Recorder* recorder = nullptr,
                                       HomeRequest* home = nullptr);

// `knuckle master --observe`: hears the machine's messages and says what it does; sends it nothing.

struct ObserverOutcome {
  std::vector<MasterEvent> events;  ///< Of the machine: the first of each kind, and the newest others (RunEvents).
  std::uint64_t messages = 0;
  double ran_s = 0;
  std::uint64_t records_lost = 0;  ///< Events there was no room for.
};

class Observer {
 public:
  /// @param link used by this thread alone.
  Observer(Link& link, ProgramConsole& console) : link_(link), console_(console) {}

  /// Takes what has come, and tells what is new. Often.
  void tend(Time now);
  /// After the run.
  [[nodiscard]] ObserverOutcome outcome(double ran_s) const;

 private:
  void tell(Time now);

  Link& link_;
  ProgramConsole& console_;
  RunEvents<MasterEvent> events_;
  std::uint64_t messages_ = 0;
  std::optional<SlaveMessage> newest_;
  Time heard_at_{};
  MasterEvent last_;
};

/// Runs one until the run is over.
[[nodiscard]] ObserverOutcome run_observer(Link& link, const ProgramRun& run);

}  // namespace knuckle::programs
