// What a side of the link draws at its start: a number by which it is told from its earlier runs, and where its time
// stamps begin. Loops are given it; only programs draw.
#pragma once

#include <cstdint>

#include "core/time.h"

namespace knuckle {

struct LinkStart {
  std::uint64_t session = 0;  ///< Not 0: nobody follows that one.
  Duration origin{};          ///< Added to the sender's clock in every stamp; up to 4.6 years.
};

/// From the operating system's random numbers. @throws InputError where there are none.
[[nodiscard]] LinkStart random_start();

/// The ends of a session on virtual time.
enum class LinkEnd : std::uint8_t { kOperator = 1, kMachine = 2 };
/// The same for the same seed.
[[nodiscard]] LinkStart start_from(std::uint64_t seed, LinkEnd end) noexcept;

}  // namespace knuckle
