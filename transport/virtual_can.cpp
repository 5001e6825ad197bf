#include "transport/virtual_can.h"

#include <algorithm>
#include <string>

#include "core/error.h"

namespace knuckle {

VirtualCanBus::VirtualCanBus(std::size_t ports, std::uint32_t bit_rate)
    : count_(ports), bit_(bit_rate == 0 ? 0 : 1'000'000'000 / bit_rate) {
  if (ports > kMaxPorts) throw InputError("virtual CAN bus: at most 8 ports, not " + std::to_string(ports));
  if (bit_rate == 0) throw InputError("virtual CAN bus: bit rate must be above 0");
  for (Port& port : ports_) port.bus_ = this;
}

namespace {

/// What arbitration compares, bit by bit: of 29 bits the first 11, SRR and IDE, which lose against any of 11, the rest.
std::uint64_t arbitration(std::uint32_t id) noexcept {
  constexpr std::uint64_t kRecessive = 3;
  if ((id & kExtendedId) == 0) return std::uint64_t{id} << 20;
  return std::uint64_t{id & kMostExtendedId} >> 18 << 20 | kRecessive << 18 | (id & 0x3FFFFU);
}

}  // namespace

bool VirtualCanBus::Port::send(const CanFrame& frame) noexcept {
  if (was_off_ || down_) return false;
  if (silent_) return true;  // its controller believes that it was sent
  if (waiting_ == kSendSlots) {
    ++dropped_;
    return false;
  }
  sending_[waiting_++] = {arbitration(frame.id) << 32 | (bus_->order_++ & 0xFFFFFFFFU), frame};
  ++bus_->waiting_;
  return true;
}

bool VirtualCanBus::Port::receive(CanFrame& frame) noexcept {
  if (unread_ == 0) return false;
  frame = received_[oldest_];
  oldest_ = (oldest_ + 1) % kReceiveSlots;
  --unread_;
  return true;
}

CanState VirtualCanBus::Port::state() const noexcept {
  if (down_) return CanState::kDown;
  if (was_off_) return CanState::kBusOff;
  // Without anybody to acknowledge, a controller's error counter stops at error passive.
  return bus_->cut_ || disconnected_ || disturbed_ ? CanState::kPassive : CanState::kActive;
}

void VirtualCanBus::Port::hear(const CanFrame& frame) noexcept {
  if (off_ || down_ || disconnected_) return;
  if (unread_ == kReceiveSlots) {
    ++dropped_;
    return;
  }
  received_[(oldest_ + unread_++) % kReceiveSlots] = frame;
}

void VirtualCanBus::advance(Time now) noexcept {
  if (!sending_) free_at_ = std::max(free_at_, now_);
  while (sending_ || start_next()) {
    if (free_at_ > now) break;
    finish();
  }
  now_ = std::max(now_, now);
}

bool VirtualCanBus::start_next() noexcept {
  if (cut_ || waiting_ == 0) return false;
  Port::Waiting* winner = nullptr;
  for (std::size_t p = 0; p < count_; ++p) {
    Port& port = ports_[p];
    if (port.disconnected_) continue;
    for (std::size_t i = 0; i < port.waiting_; ++i) {
      if (winner == nullptr || port.sending_[i].rank < winner->rank) {
        winner = &port.sending_[i];
        sender_ = p;
      }
    }
  }
  if (winner == nullptr) return false;
  on_wire_ = winner->frame;
  *winner = ports_[sender_].sending_[--ports_[sender_].waiting_];
  --waiting_;
  const Duration length = worst_case_bits(on_wire_.size, on_wire_.id) * bit_;
  busy_ += length;
  free_at_ += length;
  sending_ = true;
  return true;
}

void VirtualCanBus::finish() noexcept {
  sending_ = false;
  if (cut_ || ports_[sender_].disconnected_) return;  // broken off: nobody acknowledged it
  ++frames_;
  for (std::size_t p = 0; p < count_; ++p) {
    if (p != sender_) ports_[p].hear(on_wire_);
  }
  if (tap_.on_frame != nullptr) tap_.on_frame(tap_.context, free_at_, on_wire_);
}

void VirtualCanBus::empty(Port& port) noexcept {
  waiting_ -= port.waiting_;
  port.waiting_ = 0;
}

void VirtualCanBus::silence(std::size_t port, bool on) noexcept {
  ports_[port].silent_ = on;
  empty(ports_[port]);
}

void VirtualCanBus::bus_off(std::size_t port) noexcept {
  silence(port, false);
  ports_[port].off_ = ports_[port].was_off_ = true;
  ports_[port].unread_ = 0;
}

void VirtualCanBus::take_down(std::size_t port, bool down) noexcept {
  empty(ports_[port]);
  ports_[port].down_ = down;
  ports_[port].unread_ = 0;
}

}  // namespace knuckle
