// What the machine's own controller can be made to do wrong with the frames that it sends by itself.
#pragma once

#include <cstdint>
#include <vector>

#include "machine/bus_description.h"
#include "transport/can_bus.h"

namespace knuckle::sim {

enum class BroadcastFault : std::uint8_t {
  kNone,
  kSilent,        ///< Does not come.
  kFrozen,        ///< The last frame comes again and again, its counter and checksum with it.
  kValuesFrozen,  ///< The last values; counter and checksum go on.
  kInvalid,       ///< What says that there is no value; else the highest that the bits can say.
  kSpike,         ///< One frame far off, then well again.
  kChecksum,      ///< A wrong checksum.
  kShort,         ///< A byte less.
};

class BroadcastFaults {
 public:
  explicit BroadcastFaults(const std::vector<BroadcastFrame>& frames) : frames_(frames.size()) {}

  /// @param signals a bit for each place in kSignals: the values that it is about; of kFrozen, kSilent, kChecksum and
  /// kShort the whole frame is.
  void inject(std::size_t frame, BroadcastFault fault, std::uint64_t signals) noexcept;
  /// Before counter and checksum are written.
  void spoil_values(std::size_t frame, const BroadcastFrame& sent, CanFrame& out) noexcept;
  /// When all is written. @return false: it does not come.
  [[nodiscard]] bool spoil(std::size_t frame, const BroadcastFrame& sent, CanFrame& out) noexcept;

 private:
  struct One {
    BroadcastFault fault = BroadcastFault::kNone;
    std::uint64_t signals = 0;
    CanFrame last{};  ///< As it was sent.
    bool spiked = false;
  };
  std::vector<One> frames_;  // sized once, at construction
};

}  // namespace knuckle::sim
