// A HID cable on virtual time: two ends joined by bounded rings of 64 reports. What one end writes can be read at the
// other after the next advance(), that is one tick later. It can be unplugged.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "transport/hid_port.h"

namespace knuckle {

class HidPair {
 public:
  static constexpr std::size_t kSlots = 64;

  HidPair() noexcept {
    host_.peer_ = &device_;
    device_.peer_ = &host_;
  }
  HidPair(const HidPair&) = delete;
  HidPair& operator=(const HidPair&) = delete;

  /// The driver's end and the firmware's end.
  [[nodiscard]] HidPort& host() noexcept { return host_; }
  [[nodiscard]] HidPort& device() noexcept { return device_; }
  /// Call once a tick: what was written before it can be read from now on.
  void advance() noexcept;
  /// Pulls the cable: what is on the way is lost, and both ends are told.
  void unplug() noexcept;
  void plug() noexcept { host_.connected_ = device_.connected_ = true; }
  /// Reports refused because a ring was full.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return host_.dropped_ + device_.dropped_; }

 private:
  class End final : public HidPort {
   public:
    bool write(const HidReport& report) noexcept override;
    bool read(HidReport& report) noexcept override;
    [[nodiscard]] bool connected() const noexcept override { return connected_; }

   private:
    friend class HidPair;
    End* peer_ = nullptr;
    std::array<HidReport, kSlots> incoming_{};
    std::size_t oldest_ = 0, stored_ = 0, readable_ = 0;
    std::uint64_t dropped_ = 0;
    bool connected_ = true;
  };
  End host_, device_;
};

}  // namespace knuckle
