// `knuckle doctor`: checks this computer, a machine bus or a haptic device. Reads only.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "app/bringup/doctor_bus.h"
#include "app/bringup/doctor_finding.h"
#include "app/cli/command.h"
#include "app/cli/json.h"
#include "transport/secure/identity.h"
#include "transport/socket_address.h"

namespace knuckle::bringup {

// The output of `knuckle doctor`, for people and for tools (docs/commissioning.md).

/// One line each: faults, notes, ok.
[[nodiscard]] std::vector<std::string> finding_lines(const Findings& findings);
/// The table of nodes, an empty line, the findings.
[[nodiscard]] std::vector<std::string> diagnosis_lines(const BusDiagnosis& diagnosis);

[[nodiscard]] cli::Json findings_json(const Findings& findings);
[[nodiscard]] cli::Json diagnosis_json(const BusDiagnosis& diagnosis);

/// Exit codes: 0 no fault; 1 a fault; 2 wrong usage, or the bus cannot be opened.
[[nodiscard]] cli::Command doctor_entry();

// What this computer provides for Knuckle: real-time scheduling, locked memory, CAN, haptic devices. Facts are
// collected apart from their judgement, so that the judgement can be tested on any computer.

struct ComputerFacts {
  bool fifo_granted = false;  ///< SCHED_FIFO at the priority of the loops.
  bool memory_lock_granted = false;
  bool realtime_kernel = false;  ///< PREEMPT_RT
  std::string governor;          ///< Of the first processor's frequency; empty where it has none.
  bool can_in_kernel = false;    ///< A raw CAN socket can be opened.
  int can_error = 0;             ///< errno where it cannot.
  std::vector<std::string> can_interfaces;
  struct DeviceFile {
    std::string path;
    bool usable = false;  ///< This user may read and write it.
  };
  bool hidraw_in_kernel = false;
  std::vector<DeviceFile> hidraw;
  bool usb_files = false;  ///< /dev/bus/usb, which libusb needs.
};
[[nodiscard]] ComputerFacts computer_facts();
[[nodiscard]] Findings judge_computer(const ComputerFacts& facts);

// Whether the machine's side can be reached and lets this computer in; each failure in one line.

struct LinkDoctorOptions {
  std::string address;  ///< Of the machine's side; its name may have several addresses.
  std::string keys;     ///< Folder; empty: the usual one.
  std::chrono::milliseconds patience{4000};
};
/// Takes control from nobody. @param keep_on asked now and then; false ends it.
[[nodiscard]] Findings doctor_link(const LinkDoctorOptions& options, const std::function<bool()>& keep_on);
/// The part of it that tries the addresses of a name. The link takes whichever lets it in: what is wrong with the
/// others is a note then, and a fault only where none does.
[[nodiscard]] Findings try_addresses(const std::vector<SocketAddress>& addresses, const secure::Identity& identity,
                                     const secure::Peers& peers, std::chrono::milliseconds patience,
                                     const std::function<bool()>& keep_on);

}  // namespace knuckle::bringup
