// Any datagram: refused, or a message that survives being sent again.
#include <cmath>
#include <optional>

#include "tests/fuzz/require.h"
#include "transport/link_messages.h"
#include "transport/machine_status.h"

namespace {

using knuckle::test::require;

bool finite(const knuckle::MachineStatus& status) {
  return status.valve_command.allFinite() && status.spool.allFinite() && std::isfinite(status.oil_flow_m3ps) &&
         std::isfinite(status.hydraulic_power_W) && std::isfinite(status.buses[0].load) &&
         std::isfinite(status.buses[1].load);
}
bool finite(const knuckle::HomeMessage& home) {
  return home.cylinder <= 7;
}
template <typename Message>
bool finite(const Message& message) {
  return message.position_rad.allFinite() && message.velocity_radps.allFinite();
}

template <typename Decode>
void check(std::span<const std::uint8_t> bytes, Decode decode) {
  const auto message = decode(bytes);
  if (!message) return;
  require(finite(*message));
  const knuckle::Datagram once = encode(*message);
  const auto again = decode(once.view());
  require(again.has_value());
  const knuckle::Datagram twice = encode(*again);
  require(once.size == twice.size && once.bytes == twice.bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  check(bytes, knuckle::decode_master);
  check(bytes, knuckle::decode_slave);
  check(bytes, knuckle::decode_status);
  check(bytes, knuckle::decode_home);
  return 0;
}
