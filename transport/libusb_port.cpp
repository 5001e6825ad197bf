#include <libusb-1.0/libusb.h>
#include <sys/time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <utility>

#include "transport/hid_device_port.h"
#include "transport/hid_reports.h"

namespace knuckle {
namespace {

constexpr std::size_t kInTransfers = 3;   // always queued, so that the bus asks in every millisecond
constexpr std::size_t kOutTransfers = 2;  // one on the bus, the next behind it
constexpr unsigned kOutTimeout_ms = 100;

using Context = std::unique_ptr<libusb_context, decltype(&libusb_exit)>;
using LibusbHandle = std::unique_ptr<libusb_device_handle, decltype(&libusb_close)>;
using Transfer = std::unique_ptr<libusb_transfer, decltype(&libusb_free_transfer)>;

Transfer new_transfer() {
  return Transfer(libusb_alloc_transfer(0), libusb_free_transfer);
}

timeval to_timeval(Duration duration) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
  return {us / 1'000'000, us % 1'000'000};
}

/// The HID interface with an interrupt endpoint each way.
struct Endpoints {
  int interface = 0;
  unsigned char in = 0, out = 0;
};

std::optional<Endpoints> endpoints_of(const libusb_interface_descriptor& interface) {
  Endpoints endpoints{interface.bInterfaceNumber};
  for (std::size_t i = 0; i < interface.bNumEndpoints; ++i) {
    const libusb_endpoint_descriptor& endpoint = interface.endpoint[i];
    if ((endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_INTERRUPT) continue;
    const bool in = (endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) != 0;
    (in ? endpoints.in : endpoints.out) = endpoint.bEndpointAddress;
  }
  const bool complete = interface.bInterfaceClass == LIBUSB_CLASS_HID && endpoints.in != 0 && endpoints.out != 0;
  return complete ? std::optional(endpoints) : std::nullopt;
}

std::optional<Endpoints> endpoints_of(libusb_device* device) {
  libusb_config_descriptor* raw = nullptr;
  if (libusb_get_active_config_descriptor(device, &raw) != 0) return std::nullopt;
  const std::unique_ptr<libusb_config_descriptor, decltype(&libusb_free_config_descriptor)> config(
      raw, libusb_free_config_descriptor);
  for (std::size_t i = 0; i < config->bNumInterfaces; ++i) {
    if (config->interface[i].num_altsetting < 1) continue;
    if (const auto endpoints = endpoints_of(config->interface[i].altsetting[0])) return endpoints;
  }
  return std::nullopt;
}

/// An opened device with its transfers. read() is the event thread: all completions are handled inside it.
class LibusbConnection final : public HidConnection {
 public:
  LibusbConnection(std::shared_ptr<libusb_context> context, LibusbHandle handle, const Endpoints& endpoints);
  ~LibusbConnection() override;
  /// Queues the first transfers. False where the device refuses them.
  bool start();

  Result read(HidReport& report, Duration timeout) override;
  Result write(const HidReport& report) override;
  void abandon() noexcept override;

 private:
  struct Slot {
    LibusbConnection* owner = nullptr;
    Transfer transfer = new_transfer();
    HidReport report{};
    std::atomic<bool> queued{false};
  };
  static void LIBUSB_CALL on_in(libusb_transfer* transfer);
  static void LIBUSB_CALL on_out(libusb_transfer* transfer);
  bool submit(Slot& slot);
  Slot* free_out_slot();
  [[nodiscard]] bool any_queued() const;

  std::shared_ptr<libusb_context> context_;
  LibusbHandle handle_;
  Endpoints endpoints_;
  std::array<Slot, kInTransfers> in_;
  std::array<Slot, kOutTransfers> out_;
  Ring<HidReport, 16> arrived_;  // within the event thread: more than one transfer may complete at a time
  std::atomic<bool> gone_{false};
  std::atomic<std::uint32_t> completed_out_{0};
};

LibusbConnection::LibusbConnection(std::shared_ptr<libusb_context> context, LibusbHandle handle,
                                   const Endpoints& endpoints)
    : context_(std::move(context)), handle_(std::move(handle)), endpoints_(endpoints) {
  constexpr int kSize = static_cast<int>(std::tuple_size_v<HidReport>);
  for (Slot& slot : in_) {
    slot.owner = this;
    libusb_fill_interrupt_transfer(slot.transfer.get(), handle_.get(), endpoints.in, slot.report.data(), kSize, on_in,
                                   &slot, 0);
  }
  for (Slot& slot : out_) {
    slot.owner = this;
    libusb_fill_interrupt_transfer(slot.transfer.get(), handle_.get(), endpoints.out, slot.report.data(), kSize, on_out,
                                   &slot, kOutTimeout_ms);
  }
}

LibusbConnection::~LibusbConnection() {
  gone_ = true;  // completed transfers are not queued again
  for (Slot& slot : in_) libusb_cancel_transfer(slot.transfer.get());
  for (Slot& slot : out_) libusb_cancel_transfer(slot.transfer.get());
  timeval wait = to_timeval(kOutTimeout_ms * 1ms);
  while (any_queued()) libusb_handle_events_timeout_completed(context_.get(), &wait, nullptr);
  libusb_release_interface(handle_.get(), endpoints_.interface);
}

bool LibusbConnection::start() {
  return std::all_of(in_.begin(), in_.end(), [this](Slot& slot) { return submit(slot); });
}

bool LibusbConnection::submit(Slot& slot) {
  slot.queued = true;
  if (libusb_submit_transfer(slot.transfer.get()) == 0) return true;
  slot.queued = false;
  return false;
}

void LIBUSB_CALL LibusbConnection::on_in(libusb_transfer* transfer) {
  Slot& slot = *static_cast<Slot*>(transfer->user_data);
  LibusbConnection& self = *slot.owner;
  slot.queued = false;
  if (transfer->status == LIBUSB_TRANSFER_COMPLETED) {
    std::fill(slot.report.begin() + transfer->actual_length, slot.report.end(), std::uint8_t{0});
    if (transfer->actual_length > 0) (void)self.arrived_.push(slot.report);  // an empty packet only says "no more"
    if (!self.gone_ && self.submit(slot)) return;
  }
  self.gone_ = true;  // unplugged, stalled, or cancelled: begin anew
}

void LIBUSB_CALL LibusbConnection::on_out(libusb_transfer* transfer) {
  Slot& slot = *static_cast<Slot*>(transfer->user_data);
  LibusbConnection& self = *slot.owner;
  slot.queued = false;
  if (transfer->status == LIBUSB_TRANSFER_NO_DEVICE) self.gone_ = true;
  ++self.completed_out_;
  self.completed_out_.notify_one();
}

HidConnection::Result LibusbConnection::read(HidReport& report, Duration timeout) {
  if (arrived_.pop(report)) return Result::kDone;
  timeval wait = to_timeval(timeout);
  if (libusb_handle_events_timeout_completed(context_.get(), &wait, nullptr) != 0) gone_ = true;
  if (arrived_.pop(report)) return Result::kDone;
  return gone_ ? Result::kGone : Result::kNothing;
}

void LibusbConnection::abandon() noexcept {
  gone_ = true;
  ++completed_out_;  // no completion will wake a writer any more
  completed_out_.notify_one();
}

LibusbConnection::Slot* LibusbConnection::free_out_slot() {
  const auto slot = std::find_if(out_.begin(), out_.end(), [](const Slot& s) { return !s.queued; });
  return slot == out_.end() ? nullptr : &*slot;
}

HidConnection::Result LibusbConnection::write(const HidReport& report) {
  for (;;) {
    const std::uint32_t completed = completed_out_;
    if (gone_) return Result::kGone;
    if (Slot* slot = free_out_slot()) {
      slot->report = report;
      return submit(*slot) ? Result::kDone : Result::kNothing;
    }
    completed_out_.wait(completed);
  }
}

bool LibusbConnection::any_queued() const {
  const auto queued = [](const Slot& slot) { return slot.queued.load(); };
  return std::any_of(in_.begin(), in_.end(), queued) || std::any_of(out_.begin(), out_.end(), queued);
}

/// A fresh context sees what is attached now, whether or not anybody announces hot-plugging (a small system may run
/// without udev's daemon).
std::shared_ptr<libusb_context> new_context(std::string& problem) {
  libusb_context* raw = nullptr;
  const int error = libusb_init(&raw);
  if (error == 0) return {raw, libusb_exit};
  problem = std::string("this computer has no usable USB (") + libusb_strerror(error) + ")";
  return nullptr;
}

/// A haptic device on the bus, referenced as long as this lives; and what opening it came to.
struct UsbDevice {
  std::shared_ptr<libusb_device> device;
  LibusbHandle handle{nullptr, libusb_close};
  int error = 0;
};

std::string serial_of(libusb_device_handle* handle, std::uint8_t index) {
  std::array<unsigned char, 128> text{};
  const int size =
      index == 0 ? 0 : libusb_get_string_descriptor_ascii(handle, index, text.data(), static_cast<int>(text.size()));
  return size <= 0 ? "" : std::string(text.begin(), text.begin() + size);
}

std::string usb_port_of_device(libusb_device* device) {
  std::array<std::uint8_t, 7> ports{};  // as many hubs as USB allows
  const int count = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string port;
  for (int i = 0; i < count; ++i)
    port += (i == 0 ? std::to_string(libusb_get_bus_number(device)) + "-" : std::string(".")) +
            std::to_string(ports[static_cast<std::size_t>(i)]);
  return port;
}

/// All haptic devices, opened where they may be. `candidates` in the same order.
std::vector<UsbDevice> open_all(libusb_context* context, std::vector<HidCandidate>& candidates) {
  std::vector<UsbDevice> devices;
  libusb_device** list = nullptr;
  const auto count = libusb_get_device_list(context, &list);
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(list[i], &descriptor) != 0) continue;
    if (descriptor.idVendor != kHidVendor || descriptor.idProduct != kHidProduct) continue;
    UsbDevice device;
    device.device = {libusb_ref_device(list[i]), libusb_unref_device};
    libusb_device_handle* handle = nullptr;
    device.error = libusb_open(list[i], &handle);
    device.handle.reset(handle);
    candidates.push_back({"USB bus " + std::to_string(libusb_get_bus_number(list[i])) + " device " +
                              std::to_string(libusb_get_device_address(list[i])),
                          handle != nullptr ? serial_of(handle, descriptor.iSerialNumber) : "",
                          usb_port_of_device(list[i])});
    devices.push_back(std::move(device));
  }
  if (count >= 0) libusb_free_device_list(list, 1);
  return devices;
}

}  // namespace

HidOpening open_libusb(const HidChoice& wanted) {
  HidOpening opening;
  const std::shared_ptr<libusb_context> context = new_context(opening.problem);
  if (!context) return opening;
  std::vector<HidCandidate> found;
  std::vector<UsbDevice> devices = open_all(context.get(), found);
  const HidCandidate* chosen = choose_device(found, wanted, opening.problem);
  if (chosen == nullptr) return opening;
  UsbDevice& device = devices[static_cast<std::size_t>(chosen - found.data())];
  if (!device.handle) {
    opening.problem = chosen->path + " cannot be opened (" + libusb_strerror(device.error) +
                      "): install config/udev/70-knuckle.rules and attach the device again";
    return opening;
  }
  const auto endpoints = endpoints_of(device.device.get());
  if (!endpoints) {
    opening.problem = chosen->path + " has no HID interface with an interrupt endpoint each way";
    return opening;
  }
  libusb_set_auto_detach_kernel_driver(device.handle.get(), 1);
  if (const int error = libusb_claim_interface(device.handle.get(), endpoints->interface); error != 0) {
    opening.problem = chosen->path + " is in use by another program (" + libusb_strerror(error) + ")";
    return opening;
  }
  const auto connection = std::make_shared<LibusbConnection>(context, std::move(device.handle), *endpoints);
  if (!connection->start()) {
    opening.problem = chosen->path + " refuses transfers";
    return opening;
  }
  opening.serial = chosen->serial;
  opening.connection = connection;
  return opening;
}

std::vector<HidCandidate> libusb_devices() {
  std::string problem;
  std::vector<HidCandidate> found;
  if (const auto context = new_context(problem)) (void)open_all(context.get(), found);
  return found;
}

}  // namespace knuckle
