#include "transport/hid_device_port.h"

#include <filesystem>
#include <string_view>
#include <utility>

#include "core/realtime_thread.h"
#include "core/text.h"
#include "transport/hid_reports.h"

namespace knuckle {
namespace {

constexpr Duration kLookAgain = 250ms;  // while no device is there
constexpr Duration kReadWait = 100ms;   // how late a reader may notice that it is to stop

constexpr bool is_attached(std::uint32_t attachment) noexcept {
  return (attachment & 1U) != 0;
}

}  // namespace

namespace {

/// "serial number 7 at USB port 1-2 (/dev/hidraw0)"
std::string described(const HidCandidate& candidate) {
  const std::string port = candidate.usb_port.empty() ? "" : " at USB port " + candidate.usb_port;
  const std::string serial = candidate.serial.empty() ? "no serial number" : "serial number " + candidate.serial;
  return shortened(serial) + port + " (" + candidate.path + ")";
}

std::string described(const std::vector<const HidCandidate*>& candidates) {
  std::string all;
  for (const HidCandidate* candidate : candidates) all += (all.empty() ? "" : ", ") + described(*candidate);
  return all;
}

}  // namespace

const HidCandidate* choose_device(const std::vector<HidCandidate>& found, const HidChoice& choice,
                                  std::string& problem) {
  std::vector<const HidCandidate*> all, right;
  for (const HidCandidate& candidate : found) {
    all.push_back(&candidate);
    const bool serial = choice.serial.empty() || candidate.serial == choice.serial;
    const bool port = choice.usb_port.empty() || candidate.usb_port == choice.usb_port;
    if (serial && port) right.push_back(&candidate);
  }
  if (right.size() == 1) return right.front();
  const std::string wanted = (choice.serial.empty() ? "" : " with serial number " + choice.serial) +
                             (choice.usb_port.empty() ? "" : " at USB port " + choice.usb_port);
  if (found.empty()) {
    problem = "no haptic device is attached (USB " + std::string(kHidUsbId) + ")";
  } else if (right.empty()) {
    problem = "no haptic device" + wanted + " is attached; there is: " + described(all);
  } else if (choice.serial.empty()) {
    problem =
        "several haptic devices are attached: choose one by its serial number or its USB port: " + described(right);
  } else {
    problem = "several haptic devices have serial number " + choice.serial +
              ": choose one by its USB port: " + described(right);
  }
  problem = printable(problem);
  return nullptr;
}

std::string usb_port_of(const std::string& sysfs_folder) {
  std::string port;
  const auto is_port = [](std::string_view name) {  // of a root hub: "usb1"; of an interface: "1-2:1.0"
    return name.find('-') != std::string_view::npos && name.find_first_not_of("0123456789-.") == std::string_view::npos;
  };
  for (const auto& name : std::filesystem::path(sysfs_folder)) {
    if (is_port(name.string())) port = name.string();
  }
  return port;
}

HidDevicePort::HidDevicePort(HidOpen open, const HidDeviceOptions& options)
    : open_(std::move(open)),
      options_(options),
      serial_(options.choice.serial),
      problem_("still looking for the haptic device"),
      reader_([this] { read_loop(); }),
      writer_([this] { write_loop(); }) {}

HidDevicePort::~HidDevicePort() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  stopping_.notify_all();
  ++writes_;
  writes_.notify_all();
  reader_.join();
  writer_.join();
}

bool HidDevicePort::write(const HidReport& report) noexcept {
  if (!is_attached(seen_)) return false;
  (report[0] == kReportTorque ? command_ : request_).put({report, seen_});
  ++writes_;
  writes_.notify_one();
  return true;
}

bool HidDevicePort::read(HidReport& report) noexcept {
  Tagged arrived;
  while (arrived_.pop(arrived)) {
    if (arrived.attachment != seen_) continue;
    report = arrived.report;
    return true;
  }
  return false;
}

bool HidDevicePort::connected() const noexcept {
  const std::uint32_t before = std::exchange(seen_, attachment_.load(std::memory_order_acquire));
  const bool lost_meanwhile = is_attached(before) && before != seen_;
  return is_attached(seen_) && !lost_meanwhile;
}

HidDeviceStatus HidDevicePort::status() const {
  HidDeviceStatus status;
  status.attached = is_attached(attachment_);
  status.arrived = reports_;
  status.dropped = arrived_.dropped();
  status.written = written_;
  status.not_written = not_written_;
  const std::lock_guard lock(told_mutex_);
  status.serial = serial_;
  status.problem = problem_;
  return status;
}

void HidDevicePort::read_loop() {
  if (options_.fifo_priority > 0) ask_for_fifo(options_.fifo_priority);
  while (!stop_) {
    if (attach()) {
      read_until_gone();
      detach();
    } else {
      pause();
    }
  }
}

bool HidDevicePort::attach() {
  std::string serial;
  {
    const std::lock_guard lock(told_mutex_);
    serial = serial_;
  }
  HidOpening opened = open_({serial, options_.choice.usb_port});
  {
    const std::lock_guard lock(told_mutex_);
    problem_ = opened.problem;
    if (opened.connection && serial_.empty()) serial_ = opened.serial;
  }
  if (!opened.connection) return false;
  const std::lock_guard lock(mutex_);
  connection_ = std::move(opened.connection);
  attachment_.fetch_add(1, std::memory_order_release);
  return true;
}

void HidDevicePort::read_until_gone() {
  // Only this thread replaces the connection.
  HidConnection& connection = *connection_;
  Tagged arrived;
  arrived.attachment = attachment_;
  while (!stop_) {
    const auto result = connection.read(arrived.report, kReadWait);
    if (result == HidConnection::Result::kGone) return;
    if (result == HidConnection::Result::kNothing) continue;
    ++reports_;
    (void)arrived_.push(arrived);  // a full ring counts it
  }
}

void HidDevicePort::detach() {
  attachment_.fetch_add(1, std::memory_order_release);
  {
    const std::lock_guard lock(told_mutex_);
    problem_ = "the haptic device was unplugged, or stopped answering";
  }
  std::shared_ptr<HidConnection> gone;  // closed here, or by the writer when it comes back from a blocked write
  const std::lock_guard lock(mutex_);
  gone.swap(connection_);
  gone->abandon();
}

void HidDevicePort::write_loop() {
  if (options_.fifo_priority > 0) ask_for_fifo(options_.fifo_priority);
  std::uint32_t seen = 0;
  Tagged wanted;
  while (!stop_) {
    writes_.wait(seen);
    seen = writes_;
    if (request_.take(wanted)) send(wanted);
    if (command_.take(wanted)) send(wanted);
  }
}

void HidDevicePort::send(const Tagged& wanted) {
  std::shared_ptr<HidConnection> connection;
  {
    const std::lock_guard lock(mutex_);
    // A command for a device that has been away meanwhile would meet one that nobody has aligned yet.
    if (wanted.attachment == attachment_) connection = connection_;
  }
  const bool sent = connection && connection->write(wanted.report) == HidConnection::Result::kDone;
  ++(sent ? written_ : not_written_);
}

void HidDevicePort::pause() {
  std::unique_lock lock(mutex_);
  stopping_.wait_for(lock, kLookAgain, [this] { return stop_.load(); });
}

}  // namespace knuckle
