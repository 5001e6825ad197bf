// The haptic device as a program: the simulated firmware and a simulated hand at the device's end of a real cable, in
// real time, for bringing up the driver or the operator's side without a device.
#pragma once

#include <cstdint>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "app/programs/program_console.h"
#include "core/joints.h"
#include "core/time.h"
#include "machine/description.h"
#include "machine/device_description.h"
#include "sim/device_firmware.h"
#include "sim/operator.h"
#include "sim/person.h"
#include "transport/hid_port.h"
#include "transport/link.h"

namespace knuckle::programs {

// What it can be made to do wrong, at a time: for trying out how the driver takes it.

struct PlannedDeviceFault {
  sim::FirmwareFault kind = sim::FirmwareFault::kNone;
  double at_s = 0;
  double duration_s = std::numeric_limits<double>::infinity();
  std::string text;  ///< As given on the command line.
};
/// "KIND@S[+D]". @throws InputError naming --fault, its value and what is wrong with it.
[[nodiscard]] PlannedDeviceFault parse_device_fault(const std::string& text);

class DeviceFaults {
 public:
  explicit DeviceFaults(std::vector<PlannedDeviceFault> plan);

  /// Before each cycle of the firmware; of several faults at a time the last one counts.
  /// @return the fault that began or ended just now: its place in the plan; else -1.
  int step(Time now, sim::DeviceFirmware& firmware) noexcept;
  [[nodiscard]] bool broken(int fault) const noexcept { return broken_[static_cast<std::size_t>(fault)]; }

 private:
  std::vector<PlannedDeviceFault> plan_;
  std::vector<char> broken_;
};

/// What the operator does, and the machine it is done with.
struct OperatorPlan {
  MachineDescription machine;
  std::vector<sim::Phase> phases;  ///< Empty: the hand holds the device still and presses nothing.
  std::vector<std::string> phase_names;
  Duration reaction = 200ms;
};

struct DeviceProgramSetup {
  DeviceDescription device;
  sim::LimbImpedance limb;
  sim::Person person;  ///< Whose limb it is.
  OperatorPlan plan;
  JointVector start_rad = JointVector::Zero();
  std::uint64_t seed = 1;
  std::uint32_t serial = 0;  ///< 0: as the device's file says, or 1.
  std::vector<PlannedDeviceFault> faults;
};

struct DeviceProgramOutcome {
  struct Phase {
    std::string name;
    double began_s = 0;
    bool timed_out = false;
  };
  struct Latch {
    double at_s = 0;
    std::uint16_t fault = 0;  ///< DeviceFault bits.
  };
  struct Fault {
    std::string text;
    double at_s = 0;
    bool broken = false;  ///< Else ended.
  };
  static constexpr std::size_t kMost = 2000;  ///< Of each; beyond them: lost, and counted.
  std::vector<Phase> phases;
  std::vector<Latch> latches;
  std::vector<Fault> faults;
  bool finished = false;   ///< The plan was carried out to its end.
  double felt_peak_N = 0;  ///< Largest force that the motors made at the tip.
  double energy_to_hand_J = 0;
  double ran_s = 0;
  RealtimeReport loop;
  std::uint64_t records_lost = 0;
};

/// Until interrupted, or until shortly after the operator has finished.
/// @param cable the device's end, used by the loop's thread alone while this runs. @param screen brings what the
/// operator sees: copies of the link's datagrams; null: nothing is seen. @param truth_csv a row every 5 ms of what is
/// truly so; null: not wanted.
[[nodiscard]] DeviceProgramOutcome run_device(const DeviceProgramSetup& setup, HidPort& cable, Link* screen,
                                              const ProgramRun& run, std::ostream* truth_csv = nullptr);

}  // namespace knuckle::programs
