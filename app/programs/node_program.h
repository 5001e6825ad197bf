// The other end of a machine's bus as a program: simulated nodes before a simulated machine, in real time, for bringing
// up a bus, a controller, or the machine's side without a machine.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "app/bringup/planned_faults.h"
#include "app/programs/program_console.h"
#include "core/joints.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "sim/truth.h"
#include "sim/world.h"
#include "transport/can_bus.h"

namespace knuckle::programs {

/// A node that is played as a device that is sold.
struct SoldDevice {
  std::uint8_t node = 0;
  std::vector<sim::DeviceObject> dictionary;
  bool lss = true;  ///< Its node id can be set by LSS.
};

struct NodeSetup {
  sim::MachineTruth truth;
  sim::WorldDescription world;
  JointVector start_rad = JointVector::Zero();
  std::uint64_t seed = 1;
  std::vector<std::uint8_t> left_out;  ///< Nodes that are not played: real ones, or none.
  std::vector<SoldDevice> devices;
  double boot_time_s = 0;  ///< Of every node.
  // By the node ids of the machine file.
  std::map<std::uint8_t, std::uint32_t> serials;
  std::map<std::uint8_t, std::uint8_t> first_ids;  ///< Until they are given another; lss::kNoNodeId: none.
  std::vector<bringup::PlannedFault> faults;
};

struct NodeOutcome {
  struct Fault {
    std::string text;
    double at_s = 0, mended_at_s = -1;  ///< -1: not ended.
  };
  struct Event {
    std::string what;  ///< Of the world: "contact", "piece_broke", ...
    double at_s = 0, value = 0;
  };
  static constexpr std::size_t kMostFaults = 2000;  ///< Beyond them: lost, and counted.
  std::vector<Fault> faults;
  std::vector<Event> events;  ///< The first of each kind, and the newest others (RunEvents).
  double peak_tip_N = 0;      ///< Largest force of the world on the bucket's tip.
  double ran_s = 0;
  RealtimeReport loop;
  std::uint64_t records_lost = 0;
};

/// @param bus used by the loop's thread alone while this runs. @param signals counts up with every signal to break what
/// waits for one. @param truth_csv a row every 5 ms of the true state; null: not wanted.
/// @throws InputError for a machine or start that cannot be simulated.
[[nodiscard]] NodeOutcome run_node(const NodeSetup& setup, CanBus& bus, const ProgramRun& run,
                                   const std::atomic<std::uint32_t>& signals, std::ostream* truth_csv = nullptr);

}  // namespace knuckle::programs
