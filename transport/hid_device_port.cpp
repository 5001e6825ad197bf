#include "transport/hid_device_port.h"

#include <utility>

#include "core/realtime_thread.h"
#include "transport/hid_reports.h"

namespace knuckle {
namespace {

constexpr Duration kLookAgain = 250ms;  // while no device is there
constexpr Duration kReadWait = 100ms;   // how late a reader may notice that it is to stop

constexpr bool is_attached(std::uint32_t attachment) noexcept {
  return (attachment & 1U) != 0;
}

}  // namespace

const HidCandidate* choose_device(const std::vector<HidCandidate>& found, const std::string& serial,
                                  std::string& problem) {
  std::string others;
  for (const HidCandidate& candidate : found) {
    if (!serial.empty() && candidate.serial == serial) return &candidate;
    others += (others.empty() ? "" : ", ") + (candidate.serial.empty() ? "none" : candidate.serial);
  }
  if (found.empty()) {
    problem = "no haptic device is attached (USB " + std::string(kHidUsbId) + ")";
  } else if (!serial.empty()) {
    problem = "the attached haptic device is another one: serial number " + others + " instead of " + serial;
  } else if (found.size() > 1) {
    problem = "several haptic devices are attached: choose one by its serial number: " + others;
  } else {
    return found.data();
  }
  return nullptr;
}

HidDevicePort::HidDevicePort(HidOpen open, const HidDeviceOptions& options)
    : open_(std::move(open)),
      options_(options),
      serial_(options.serial),
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
  HidOpening opened = open_(serial);
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
