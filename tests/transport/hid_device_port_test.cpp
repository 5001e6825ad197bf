// The threads around a real cable, with a cable in memory that can be blocked, pulled and plugged in again.
#include "transport/hid_device_port.h"

#include <gtest/gtest.h>

#include <chrono>
#include <deque>

#include "tests/support/no_alloc.h"
#include "tests/support/says.h"
#include "transport/hid_reports.h"

namespace knuckle {
namespace {

HidReport numbered(std::uint8_t report, std::uint8_t n) {
  return {report, kHidVersion, n};
}

/// What the test's thread and the port's two threads share.
class Cable {
 public:
  struct End final : HidConnection {
    explicit End(Cable& cable, int plugged) : cable_(cable), plugged_(plugged) {}
    Result read(HidReport& report, Duration timeout) override { return cable_.read(plugged_, report, timeout); }
    Result write(const HidReport& report) override { return cable_.write(plugged_, report); }
    Cable& cable_;
    int plugged_;
  };

  HidOpen opener() {
    return [this](const HidChoice& choice) {
      const std::lock_guard lock(mutex_);
      HidOpening opening;
      std::vector<HidCandidate> found;
      if (plugged_ % 2 == 1) found.push_back({"memory", serial_, port_});
      if (choose_device(found, choice, opening.problem) == nullptr) return opening;
      opening.serial = serial_;
      opening.connection = std::make_shared<End>(*this, plugged_);
      return opening;
    };
  }
  void plug(const std::string& serial = "A", const std::string& port = "1-1") {
    const std::lock_guard lock(mutex_);
    serial_ = serial;
    port_ = port;
    ++plugged_;
    changed_.notify_all();
  }
  void unplug() {
    const std::lock_guard lock(mutex_);
    to_host_.clear();
    ++plugged_;
    changed_.notify_all();
  }
  void block_writes(bool blocked) {
    const std::lock_guard lock(mutex_);
    blocked_ = blocked;
    changed_.notify_all();
  }
  void send(const HidReport& report) {
    const std::lock_guard lock(mutex_);
    to_host_.push_back(report);
    changed_.notify_all();
  }
  bool writing() {
    const std::lock_guard lock(mutex_);
    return writing_;
  }
  /// What the device was told, since it was plugged in last.
  std::vector<HidReport> told() {
    const std::lock_guard lock(mutex_);
    return told_;
  }

 private:
  using Result = HidConnection::Result;
  Result read(int plugged, HidReport& report, Duration timeout) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return plugged != plugged_ || !to_host_.empty(); });
    if (plugged != plugged_) return Result::kGone;
    if (to_host_.empty()) return Result::kNothing;
    report = to_host_.front();
    to_host_.pop_front();
    return Result::kDone;
  }
  Result write(int plugged, const HidReport& report) {
    std::unique_lock lock(mutex_);
    writing_ = true;
    changed_.wait(lock, [this] { return !blocked_; });
    writing_ = false;
    if (plugged != plugged_) return Result::kGone;
    told_.push_back(report);
    return Result::kDone;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::string serial_, port_;
  int plugged_ = 0;  // odd: attached
  bool blocked_ = false, writing_ = false;
  std::deque<HidReport> to_host_;
  std::vector<HidReport> told_;
};

/// Waits for other threads, without saying how long they may take: far beyond this, something hangs.
template <typename Condition>
bool eventually(Condition condition) {
  for (int i = 0; i < 20'000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

TEST(HidDevicePortThreads, ReportsCrossBothWaysOnceADeviceIsThere) {
  Cable cable;
  HidDevicePort port(cable.opener());
  EXPECT_FALSE(port.connected());
  EXPECT_FALSE(port.write(numbered(kReportTorque, 1)));
  cable.plug();
  ASSERT_TRUE(eventually([&] { return port.connected(); }));
  for (std::uint8_t n = 1; n <= 3; ++n) cable.send(numbered(kReportState, n));
  HidReport report;
  for (std::uint8_t n = 1; n <= 3; ++n) {
    ASSERT_TRUE(eventually([&] { return port.read(report); }));
    EXPECT_EQ(report, numbered(kReportState, n));
  }
  EXPECT_TRUE(port.write(numbered(kReportTorque, 9)));
  ASSERT_TRUE(eventually([&] { return cable.told().size() == 1; }));
  EXPECT_EQ(cable.told()[0], numbered(kReportTorque, 9));
}

TEST(HidDevicePortThreads, AfterABlockedWriteOnlyTheNewestCommandLeavesAndRequestsAreNotLostToIt) {
  Cable cable;
  cable.plug();
  HidDevicePort port(cable.opener());
  ASSERT_TRUE(eventually([&] { return port.connected(); }));
  cable.block_writes(true);
  port.write(numbered(kReportTorque, 1));
  ASSERT_TRUE(eventually([&] { return cable.writing(); }));
  port.write(numbered(kReportDescribe, 2));
  for (std::uint8_t n = 3; n <= 50; ++n) EXPECT_TRUE(port.write(numbered(kReportTorque, n)));  // none of these waits
  cable.block_writes(false);
  ASSERT_TRUE(eventually([&] { return cable.told().size() >= 3; }));
  EXPECT_EQ(cable.told(),
            (std::vector{numbered(kReportTorque, 1), numbered(kReportDescribe, 2), numbered(kReportTorque, 50)}));
}

TEST(HidDevicePortThreads, ADeviceThatCameBackBetweenTwoLooksReadsAsGoneOnce) {
  Cable cable;
  cable.plug();
  HidDevicePort port(cable.opener());
  ASSERT_TRUE(eventually([&] { return port.connected(); }));
  cable.send(numbered(kReportState, 1));
  ASSERT_TRUE(eventually([&] { return port.status().arrived == 1; }));
  cable.unplug();
  ASSERT_TRUE(eventually([&] { return !port.status().attached; }));
  cable.plug();
  ASSERT_TRUE(eventually([&] { return port.status().attached; }));
  EXPECT_FALSE(port.connected());
  EXPECT_TRUE(port.connected());
  HidReport report;
  EXPECT_FALSE(port.read(report));  // the report was made before the cable was pulled
}

TEST(HidDevicePortThreads, ACommandNeverReachesADeviceThatWasPluggedInAfterIt) {
  Cable cable;
  cable.plug();
  HidDevicePort port(cable.opener());
  ASSERT_TRUE(eventually([&] { return port.connected(); }));
  cable.block_writes(true);
  port.write(numbered(kReportTorque, 1));
  ASSERT_TRUE(eventually([&] { return cable.writing(); }));
  port.write(numbered(kReportTorque, 2));  // waits behind the blocked one
  cable.unplug();
  ASSERT_TRUE(eventually([&] { return !port.status().attached; }));
  cable.plug();
  ASSERT_TRUE(eventually([&] { return port.status().attached; }));
  cable.block_writes(false);
  ASSERT_TRUE(eventually([&] { return port.status().not_written == 2; }));
  EXPECT_TRUE(cable.told().empty());
}

TEST(HidDevicePortThreads, OnlyTheDeviceWithTheSameSerialNumberOrAtTheChosenPortIsTakenBack) {
  struct Case {
    HidChoice choice;
    const char *serial, *port, *problem;  // of the one that is plugged in instead
  };
  for (const auto& [choice, serial, usb_port, problem] :
       {Case{{}, "B", "1-1", "serial number A is attached; there is: serial number B"},
        Case{{.serial = "", .usb_port = "1-1"}, "A", "1-3", "USB port 1-1 is attached"}}) {
    Cable cable;
    cable.plug("A", "1-1");
    HidDevicePort port(cable.opener(), {.choice = choice});
    ASSERT_TRUE(eventually([&] { return port.connected(); }));
    cable.unplug();
    ASSERT_TRUE(eventually([&] { return !port.connected(); }));
    cable.plug(serial, usb_port);
    ASSERT_TRUE(eventually([&, &said = problem] { return port.status().problem.find(said) != std::string::npos; }))
        << port.status().problem;
    EXPECT_FALSE(port.connected());
    cable.unplug();
    cable.plug("A", "1-1");
    EXPECT_TRUE(eventually([&] { return port.connected(); }));
  }
}

TEST(HidDevicePortThreads, ALoopThatDoesNotReadLosesReportsAndTheyAreCounted) {
  Cable cable;
  cable.plug();
  HidDevicePort port(cable.opener());
  ASSERT_TRUE(eventually([&] { return port.connected(); }));
  for (int n = 0; n < 100; ++n) cable.send(numbered(kReportState, std::uint8_t(n)));
  ASSERT_TRUE(eventually([&] { return port.status().arrived == 100; }));
  EXPECT_EQ(port.status().dropped, 36u);
}

TEST(HidDevicePortThreads, TheLoopsCallsAllocateNothing) {
  Cable cable;
  cable.plug();
  HidDevicePort port(cable.opener());
  ASSERT_TRUE(eventually([&] { return port.connected(); }));
  HidReport report = numbered(kReportTorque, 1);
  test::NoAllocScope scope;  // counts this thread
  (void)port.connected();
  (void)port.write(report);
  (void)port.read(report);
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(HidDevicePort, ChoosesByWhatIsGivenAndSaysWhyItCannotChoose) {
  const HidCandidate seven{"/dev/hidraw0", "7", "1-2"}, twin{"/dev/hidraw1", "7", "1-3.1"},
      nameless{"/dev/hidraw1", "", ""}, rogue{"/dev/hidraw0", "\x1b[2J\n7", "1-2"};
  const std::string of_seven = "serial number 7 at USB port 1-2 (/dev/hidraw0)";
  struct Case {
    std::vector<HidCandidate> attached;
    HidChoice choice;
    int chosen;  // -1: none
    std::string problem;
  };
  const Case cases[]{
      {{}, {}, -1, "no haptic device is attached (USB 1209:0001)"},
      {{seven}, {}, 0, ""},
      {{seven}, {.serial = "8"}, -1, "no haptic device with serial number 8 is attached; there is: " + of_seven},
      {{seven, nameless}, {.serial = "7"}, 0, ""},
      {{seven, nameless},
       {},
       -1,
       "choose one by its serial number or its USB port: " + of_seven + ", no serial number"},
      {{seven, twin}, {.serial = "7"}, -1, "serial number 7: choose one by its USB port: " + of_seven + ", serial"},
      {{seven, twin}, {.usb_port = "1-3.1"}, 1, ""},
      {{seven, twin}, {.serial = "7", .usb_port = "1-2"}, 0, ""},
      {{seven, twin}, {.serial = "8", .usb_port = "1-2"}, -1, "no haptic device with serial number 8 at USB port 1-2"},
      {{rogue}, {.serial = "7"}, -1, "serial number \\x1b[2J\\x0a7 at USB port 1-2"},
      {{seven}, {.serial = rogue.serial}, -1, "no haptic device with serial number \\x1b[2J\\x0a7 is attached"},
  };
  for (const Case& c : cases) {
    std::string problem;
    const HidCandidate* const chosen = choose_device(c.attached, c.choice, problem);
    EXPECT_EQ(chosen, c.chosen < 0 ? nullptr : &c.attached[static_cast<std::size_t>(c.chosen)]) << c.problem;
    if (c.chosen < 0) {
      EXPECT_TRUE(test::says(problem, c.problem));
    }
  }
}

TEST(HidDevicePort, UsbPortsAreNamedAsTheKernelNamesThem) {
  const std::string hub = "/sys/devices/pci0000:00/0000:00:14.0/usb1/1-2/1-2.3";
  EXPECT_EQ(usb_port_of(hub + "/1-2.3:1.0/0003:1209:0001.0004"), "1-2.3");
  EXPECT_EQ(usb_port_of("/sys/devices/platform/dummy_hcd.0/usb1/1-1/1-1:1.0/0003:1209:0001.0001"), "1-1");
  EXPECT_EQ(usb_port_of("/sys/devices/virtual/misc/uhid/0003:1209:0001.0007"), "");
  EXPECT_EQ(usb_port_of(""), "");
}

TEST(HidBackEnds, SayInOneLineThatNoDeviceIsThere) {  // this computer may have neither USB nor a device
  for (HidOpening (*open)(const HidChoice&) : {open_hidapi, open_libusb}) {
    const HidOpening opening = open({.serial = "no such serial number"});
    EXPECT_EQ(opening.connection, nullptr);
    EXPECT_FALSE(opening.problem.empty());
    EXPECT_EQ(opening.problem.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace knuckle
