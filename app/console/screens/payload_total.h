// How much has been carried away: each load once, when it is released.
#pragma once

#include "core/time.h"
#include "transport/link_messages.h"

namespace knuckle::console::screens {

/// The estimate says more than that something may hang there.
[[nodiscard]] bool payload_is_known(const SlaveMessage& machine, double full_scale_kg) noexcept;

/// What counts as a load, of what the machine carries in full.
inline constexpr double kLeastLoad = 0.05;

class PayloadTotal {
 public:
  /// @param least_kg what counts as a load on this machine.
  explicit PayloadTotal(double least_kg) : least_kg_(least_kg) {}
  /// Only for current values: not to be called while no packets are received.
  void watch(const SlaveMessage& machine, Time now);
  void clear();
  [[nodiscard]] double total_kg() const noexcept { return total_kg_; }
  [[nodiscard]] int loads() const noexcept { return loads_; }

 private:
  double least_kg_;
  double total_kg_ = 0, load_kg_ = 0, load_sigma_kg_ = 0;
  int loads_ = 0;
  bool carrying_ = false;
  Time since_ = kNever, seen_ = kNever;  ///< Carried, or released.
};

}  // namespace knuckle::console::screens
