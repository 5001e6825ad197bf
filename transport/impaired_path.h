// One direction of an impaired network: the model that says what becomes of a datagram, and bounded room for those that
// are on their way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/time.h"
#include "transport/impairment_model.h"

namespace knuckle {

class ImpairedPath {
 public:
  static constexpr std::size_t kInFlight = 2048;  ///< 4 s at 500 Hz. More are dropped and counted.

  /// @param most_bytes of a datagram. Allocates all room. @throws InputError as check().
  ImpairedPath(const LinkImpairment& impairment, std::uint64_t seed, std::size_t most_bytes);

  /// @param bytes at most most_bytes. @param now never before that of an earlier call.
  void send(std::span<const std::uint8_t> bytes, Time now) noexcept;

  struct Arrival {
    std::span<const std::uint8_t> bytes;  ///< Until pop().
    Time sent_at{}, due_at{};
  };
  /// The one that is due first, if it is by then.
  [[nodiscard]] std::optional<Arrival> front(Time now) const noexcept;
  /// Takes it away.
  void pop() noexcept;
  /// When the first is due; Time::max(): none is on its way.
  [[nodiscard]] Time next_due() const noexcept { return count_ == 0 ? Time::max() : flights_[first_].due_at; }

  [[nodiscard]] ImpairmentModel& model() noexcept { return model_; }
  [[nodiscard]] const ImpairmentCounts& counts() const noexcept { return model_.counts(); }

 private:
  struct Flight {
    Time sent_at{}, due_at{};
    std::uint16_t slot = 0, size = 0;
  };
  void add(std::span<const std::uint8_t> bytes, Time sent_at, Time due_at) noexcept;

  ImpairmentModel model_;
  std::size_t most_bytes_;
  std::unique_ptr<std::uint8_t[]> bytes_;  ///< kInFlight slots; pages that are never used take no memory.
  std::vector<std::uint16_t> free_;
  std::vector<Flight> flights_;  ///< Ring sorted by due_at, equal times in order of sending.
  std::size_t first_ = 0, count_ = 0, free_count_ = kInFlight;
};

}  // namespace knuckle
