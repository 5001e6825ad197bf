#include "transport/machine_status.h"

#include <algorithm>

#include "transport/link_codec.h"

namespace knuckle {

MachineName::MachineName(std::string_view name) noexcept {
  const std::size_t size = std::min(name.size(), kSize - 1);
  std::replace_copy_if(
      name.begin(), name.begin() + static_cast<std::ptrdiff_t>(size), bytes_.begin(),
      [](char c) { return !link_codec::printable(c); }, '?');
}

std::string_view MachineName::text() const noexcept {
  return {bytes_.data(), static_cast<std::size_t>(std::find(bytes_.begin(), bytes_.end() - 1, '\0') - bytes_.begin())};
}

Datagram encode(const MachineStatus& status) noexcept {
  return link_codec::encode(status, LinkKind::kStatus);
}
std::optional<MachineStatus> decode_status(std::span<const std::uint8_t> bytes) noexcept {
  return link_codec::decode<MachineStatus>(bytes, LinkKind::kStatus);
}

}  // namespace knuckle
