// Wires of the simulated machine and device, with what can be done to them: they lose, swallow and cut short.
#pragma once

#include <bitset>
#include <cstdint>

#include "core/ring.h"
#include "transport/can_bus.h"
#include "transport/hid_port.h"

namespace knuckle {

/// The nodes' end of the machine's bus.
class FaultyPort final : public CanBus {
 public:
  explicit FaultyPort(CanBus& bus) noexcept : bus_(bus) {}
  bool send(const CanFrame& frame) noexcept override;
  bool receive(CanFrame& frame) noexcept override;
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }
  void acknowledge() noexcept override { bus_.acknowledge(); }
  [[nodiscard]] std::uint64_t errors() const noexcept override { return bus_.errors(); }

  void cut(bool on) noexcept { cut_ = on; }
  void drop_sync(bool on) noexcept { drop_sync_ = on; }
  /// What the node of this id sends is sent twice, as if a second device had its id.
  void double_node(std::uint8_t id, bool on) noexcept { doubled_[id & 0x7FU] = on; }
  /// Only the nodes on this port hear it, before anything else. As many between two steps as there are node ids.
  void whisper(const CanFrame& frame) noexcept { whispered_.push(frame); }
  /// Past everything else, onto the bus.
  bool shout(const CanFrame& frame) noexcept { return bus_.send(frame); }

 private:
  CanBus& bus_;
  bool cut_ = false, drop_sync_ = false;
  std::bitset<128> doubled_;
  Ring<CanFrame, 128> whispered_;
};

/// The firmware's end of the device's cable. Of a report that is cut short the end is not sent, and reads as zeros.
class TruncatingPort final : public HidPort {
 public:
  explicit TruncatingPort(HidPort& port) noexcept : port_(port) {}
  void truncate(bool on) noexcept { truncating_ = on; }

  bool write(const HidReport& report) noexcept override;
  bool read(HidReport& report) noexcept override { return port_.read(report); }
  [[nodiscard]] bool connected() const noexcept override { return port_.connected(); }

 private:
  HidPort& port_;
  bool truncating_ = false;
};

}  // namespace knuckle
