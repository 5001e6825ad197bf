// Any datagram: refused, or a message that survives being sent again.
#include <cmath>
#include <cstdlib>
#include <optional>

#include "transport/link_messages.h"

namespace {

template <typename Decode>
void check(std::span<const std::uint8_t> bytes, Decode decode) {
  const auto message = decode(bytes);
  if (!message) return;
  if (!message->position_rad.allFinite() || !message->velocity_radps.allFinite()) std::abort();
  const knuckle::Datagram once = encode(*message);
  const auto again = decode(once.view());
  if (!again) std::abort();
  const knuckle::Datagram twice = encode(*again);
  if (once.size != twice.size || once.bytes != twice.bytes) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  check(bytes, knuckle::decode_master);
  check(bytes, knuckle::decode_slave);
  return 0;
}
