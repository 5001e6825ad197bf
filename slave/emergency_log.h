// The newest emergency messages of all nodes, with their time: what an integrator asks for first.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/time.h"
#include "machine/bus_description.h"
#include "transport/canopen.h"

namespace knuckle::slave {

struct EmergencyRecord {
  Time at = kNever;
  std::uint8_t node = 0;
  canopen::Emergency emergency;
};

/// Keeps the newest; a node that floods the bus with them pushes the older ones out, and is counted.
class EmergencyLog {
 public:
  static constexpr std::size_t kKept = 32;
  void add(Time at, std::uint8_t node, const canopen::Emergency& emergency) noexcept {
    records_[count_++ % kKept] = {at, node, emergency};
  }
  /// Since construction, those no longer kept included.
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::size_t kept() const noexcept { return count_ < kKept ? static_cast<std::size_t>(count_) : kKept; }
  /// @param age 0 is the newest; below kept().
  [[nodiscard]] const EmergencyRecord& newest(std::size_t age = 0) const noexcept {
    return records_[(count_ - 1 - age) % kKept];
  }

 private:
  std::array<EmergencyRecord, kKept> records_{};
  std::uint64_t count_ = 0;
};

/// "tilt (node 0x38): 0x5030 sensor error (error register 0x01)". Not for loops: allocates.
[[nodiscard]] std::string text(const EmergencyRecord& record, const BusDescription& bus);

}  // namespace knuckle::slave
