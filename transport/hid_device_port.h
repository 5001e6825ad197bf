// A HID device that real hardware may take away: calls of the operating system that wait, kept out of the loop.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/mailbox.h"
#include "core/ring.h"
#include "core/time.h"
#include "transport/hid_port.h"

namespace knuckle {

/// One opened device. read() belongs to one thread and write() to another; both may be under way at a time.
class HidConnection {
 public:
  enum class Result : std::uint8_t { kDone, kNothing, kGone };
  virtual ~HidConnection() = default;
  /// Waits for a report, at most `timeout`. A report of another length than 64 bytes comes out damaged: its rest is
  /// zero, or missing.
  [[nodiscard]] virtual Result read(HidReport& report, Duration timeout) = 0;
  /// Waits until the report is on its way, which may take seconds. kNothing: it was not sent, the device is there.
  [[nodiscard]] virtual Result write(const HidReport& report) = 0;
  /// Nobody reads any more, so a write that waits for what reading brings must return. Any thread.
  virtual void abandon() noexcept {}
};

/// What looking for a device came to: a connection, or one line that says why there is none.
struct HidOpening {
  std::shared_ptr<HidConnection> connection;
  std::string serial;   ///< Serial number as USB has it; may be empty.
  std::string problem;  ///< Empty with a connection.
};
/// Which device to open; what is empty may be anything.
struct HidChoice {
  std::string serial{};    ///< As USB has it.
  std::string usb_port{};  ///< Where it is plugged in, as the kernel names it: bus and port of each hub, "1-2.3".
};
/// Looks for such a device and opens it. Called by one thread, again and again.
using HidOpen = std::function<HidOpening(const HidChoice& choice)>;

/// A device that was found.
struct HidCandidate {
  std::string path;        ///< For opening it, and for people.
  std::string serial;      ///< May be empty.
  std::string usb_port{};  ///< Empty where it is not known.
};
/// The one to open, or nullptr and the reason in one printable line: none there, none that was chosen, or several to
/// choose from, as two devices may have the same serial number.
[[nodiscard]] const HidCandidate* choose_device(const std::vector<HidCandidate>& found, const HidChoice& choice,
                                                std::string& problem);
/// Of a device's folder in /sys/devices, "/sys/devices/.../usb1/1-2/1-2.3/1-2.3:1.0/...": "1-2.3"; empty where it is
/// none of USB.
[[nodiscard]] std::string usb_port_of(const std::string& sysfs_folder);

struct HidDeviceOptions {
  HidChoice choice{};     ///< Nothing: the only device there is.
  int fifo_priority = 0;  ///< Of the two threads; 0: none asked for. Above the loop's, or the loop waits for them.
};

/// What a display or a log may ask, from any thread but the loop's.
struct HidDeviceStatus {
  bool attached = false;
  std::string serial, problem;
  std::uint64_t arrived = 0, dropped = 0;      ///< Reports read; of them, those the loop left no room for.
  std::uint64_t written = 0, not_written = 0;  ///< Reports that left; those the device or the system did not take.
};

/// The driver's end of a real cable. One thread looks for the device, opens it and reads; another writes, because a
/// write may block for seconds: always the newest command, and the newest of all other reports before it. Neither a
/// report nor a command outlives the attachment it was made in.
///
/// Once lost, only the device with the same serial number is opened again, at the same port where that was chosen. A
/// device that was lost reads as not connected at least once, however quickly it came back, so that nobody goes on as
/// if nothing had been.
class HidDevicePort : public HidPort {
 public:
  explicit HidDevicePort(HidOpen open, const HidDeviceOptions& options = {});
  /// Waits for a write that is under way.
  ~HidDevicePort() override;
  HidDevicePort(const HidDevicePort&) = delete;
  HidDevicePort& operator=(const HidDevicePort&) = delete;

  bool write(const HidReport& report) noexcept override;
  bool read(HidReport& report) noexcept override;
  [[nodiscard]] bool connected() const noexcept override;

  [[nodiscard]] HidDeviceStatus status() const;

 private:
  /// A report and the attachment it belongs to.
  struct Tagged {
    HidReport report{};
    std::uint32_t attachment = 0;
  };
  void read_loop();
  void write_loop();
  /// Opens what there is. False, with the reason noted, where there is nothing.
  bool attach();
  void read_until_gone();
  void detach();
  void send(const Tagged& wanted);
  void pause();

  HidOpen open_;
  HidDeviceOptions options_;
  // between the loop and the threads
  Ring<Tagged, 64> arrived_;
  Mailbox<Tagged> command_, request_;
  std::atomic<std::uint32_t> writes_{0};      ///< Grows with each report to send: what the writer waits on.
  std::atomic<std::uint32_t> attachment_{0};  ///< Odd while a device is attached.
  std::atomic<std::uint64_t> reports_{0}, written_{0}, not_written_{0};
  std::atomic<bool> stop_{false};
  mutable std::uint32_t seen_ = 0;  ///< The loop's: attachment_ when it last asked.
  // between the two threads
  std::mutex mutex_;
  std::condition_variable stopping_;
  std::shared_ptr<HidConnection> connection_;
  // between the reader and status(), for which the writer must not wait
  mutable std::mutex told_mutex_;
  std::string serial_, problem_;

  std::thread reader_, writer_;  ///< Last: everything above exists when they start.
};

// The haptic device through the kernel's hidraw driver (hidapi): no driver has to be detached, any user may open the
// device that the udev rule gives access to; and through libusb: asynchronous interrupt transfers, while the kernel's
// driver is detached from it (there is no /dev/hidraw then).
[[nodiscard]] HidOpening open_hidapi(const HidChoice& choice);
[[nodiscard]] HidOpening open_libusb(const HidChoice& choice);

/// The haptic devices that are attached now, whether or not they may be opened; libusb does not know the serial number
/// of one that may not.
[[nodiscard]] std::vector<HidCandidate> hidapi_devices();
[[nodiscard]] std::vector<HidCandidate> libusb_devices();

}  // namespace knuckle
