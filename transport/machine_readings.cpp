#include "transport/machine_readings.h"

#include <cmath>

#include "transport/link_codec.h"

namespace knuckle {

void ReadingsMessage::set(const MachineReadings& readings) noexcept {
  known = 0;
  unsigned i = 0;
  MachineReadings::fields(readings, [&](const char*, double value) {
    if (std::isfinite(value)) known = static_cast<std::uint8_t>(known | 1U << i);
    values[i++] = std::isfinite(value) ? value : 0;
  });
}

MachineReadings ReadingsMessage::readings() const noexcept {
  MachineReadings all;
  unsigned i = 0;
  MachineReadings::fields(all, [&](const char*, double& value) {
    if ((known >> i & 1U) != 0) value = values[i];
    ++i;
  });
  return all;
}

Datagram encode(const ReadingsMessage& message) noexcept {
  return link_codec::encode(message, LinkKind::kReadings);
}
std::optional<ReadingsMessage> decode_readings(std::span<const std::uint8_t> bytes) noexcept {
  return link_codec::decode<ReadingsMessage>(bytes, LinkKind::kReadings);
}

}  // namespace knuckle
