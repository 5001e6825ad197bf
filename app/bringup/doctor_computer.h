// What this computer provides for Knuckle: real-time scheduling, locked memory, CAN, haptic devices. Facts are
// collected apart from their judgement, so that the judgement can be tested on any computer.
#pragma once

#include <string>
#include <vector>

#include "app/bringup/doctor_finding.h"

namespace knuckle::bringup {

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

}  // namespace knuckle::bringup
