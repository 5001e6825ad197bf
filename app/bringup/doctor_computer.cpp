#include <linux/can.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "app/bringup/doctor_command.h"
#include "core/loop_table.h"

namespace knuckle::bringup {
namespace {
namespace fs = std::filesystem;
using Level = Finding::Level;

constexpr int kCanLinkType = 280;  // ARPHRD_CAN

std::string first_line(const fs::path& file) {
  std::string line;
  std::ifstream in(file);
  std::getline(in, line);
  return line;
}

/// Requested and given back at once.
bool fifo_granted() {
  sched_param before{}, wanted{};
  int policy = 0;
  if (pthread_getschedparam(pthread_self(), &policy, &before) != 0) return false;
  wanted.sched_priority = fifo_priority::kSlave;
  if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted) != 0) return false;
  pthread_setschedparam(pthread_self(), policy, &before);
  return true;
}

bool memory_lock_granted() {
  if (mlockall(MCL_CURRENT) != 0) return false;
  munlockall();
  return true;
}

std::vector<std::string> names_in(const fs::path& folder, const std::string& prefix) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(prefix)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

void look_for_can(ComputerFacts& facts) {
  const int can = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  facts.can_in_kernel = can >= 0;
  facts.can_error = can >= 0 ? 0 : errno;
  if (can >= 0) close(can);
  for (const std::string& name : names_in("/sys/class/net", "")) {
    if (first_line(fs::path("/sys/class/net") / name / "type") == std::to_string(kCanLinkType)) {
      facts.can_interfaces.push_back(name);
    }
  }
}

Finding granted(bool yes, const char* about, const char* good, const char* bad) {
  return {yes ? Level::kOk : Level::kFault, about, yes ? good : bad};
}

}  // namespace

ComputerFacts computer_facts() {
  ComputerFacts facts;
  facts.fifo_granted = fifo_granted();
  facts.memory_lock_granted = memory_lock_granted();
  facts.realtime_kernel = first_line("/sys/kernel/realtime") == "1";
  facts.governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  look_for_can(facts);
  std::error_code error;
  facts.hidraw_in_kernel = fs::exists("/sys/class/hidraw", error);
  for (const std::string& name : names_in("/dev", "hidraw")) {
    const std::string path = "/dev/" + name;
    facts.hidraw.push_back({path, access(path.c_str(), R_OK | W_OK) == 0});
  }
  facts.usb_files = fs::exists("/dev/bus/usb", error);
  return facts;
}

Findings judge_computer(const ComputerFacts& facts) {
  Findings found;
  found.push_back(
      granted(facts.fifo_granted, "SCHED_FIFO", "granted",
              "not granted: add '@knuckle - rtprio 95' to /etc/security/limits.conf, put the user into that "
              "group and log in again"));
  found.push_back(
      granted(facts.memory_lock_granted, "memory lock", "granted",
              "not granted: add '@knuckle - memlock unlimited' to /etc/security/limits.conf and log in again"));
  found.push_back({facts.realtime_kernel ? Level::kOk : Level::kNote, "kernel",
                   facts.realtime_kernel ? "PREEMPT_RT"
                                         : "not PREEMPT_RT: loops may run some milliseconds late under "
                                           "load; Debian's package is linux-image-rt-amd64"});
  if (!facts.governor.empty() && facts.governor != "performance") {
    found.push_back({Level::kNote, "processor",
                     "frequency governor is '" + facts.governor +
                         "': set 'performance' for even loop periods (cpupower frequency-set)"});
  }
  if (!facts.can_in_kernel) {
    found.push_back({Level::kFault, "SocketCAN",
                     std::string("this kernel has no CAN sockets: ") + std::strerror(facts.can_error) +
                         "; load the module (modprobe can-raw) or install a kernel with SocketCAN"});
  } else if (facts.can_interfaces.empty()) {
    found.push_back({Level::kFault, "SocketCAN",
                     "no CAN interface: plug the adapter in and load its driver (for a first trial vcan0 suffices)"});
  } else {
    std::string names;
    for (const std::string& name : facts.can_interfaces) names += (names.empty() ? "" : ", ") + name;
    found.push_back({Level::kOk, "SocketCAN", names + "; next: knuckle doctor --can " + facts.can_interfaces.front()});
  }
  found.push_back(granted(facts.hidraw_in_kernel, "hidraw", "in the kernel",
                          "not in this kernel: use the haptic device with --device usb (libusb)"));
  for (const ComputerFacts::DeviceFile& file : facts.hidraw) {
    found.push_back(
        {file.usable ? Level::kOk : Level::kNote, file.path,
         file.usable
             ? "can be opened"
             : "no permission to open it: if it is the haptic device, install the udev rule (docs/haptic-device.md)"});
  }
  found.push_back(granted(facts.usb_files, "USB", "device files for libusb are present",
                          "no /dev/bus/usb: libusb finds no devices (no USB controller, or a container without it)"));
  return found;
}

}  // namespace knuckle::bringup
