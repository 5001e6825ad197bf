#include "transport/link_start.h"

#include <sys/random.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <random>
#include <string>

#include "core/error.h"

namespace knuckle {
namespace {

LinkStart start_of(std::uint64_t session, std::uint64_t origin) noexcept {
  constexpr int kOriginBits = 57;
  return {session == 0 ? 1 : session, Duration(static_cast<std::int64_t>(origin >> (64 - kOriginBits)))};
}

}  // namespace

LinkStart random_start() {
  std::array<std::uint64_t, 2> drawn{};
  if (::getrandom(drawn.data(), sizeof drawn, 0) != static_cast<ssize_t>(sizeof drawn))
    throw InputError(std::string("link: the system gives no random numbers: ") + std::strerror(errno));
  return start_of(drawn[0], drawn[1]);
}

LinkStart start_from(std::uint64_t seed, LinkEnd end) noexcept {
  std::mt19937_64 random(4 * seed + static_cast<std::uint64_t>(end));
  const std::uint64_t session = random();
  return start_of(session, random());
}

}  // namespace knuckle
