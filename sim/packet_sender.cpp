#include "sim/packet_sender.h"

#include <algorithm>
#include <span>

namespace knuckle::sim {

std::size_t PacketSender::add(std::uint32_t id, std::uint8_t bytes) {
  messages_.push_back({.id = id, .bytes = bytes});
  return messages_.size() - 1;
}

bool PacketSender::busy(std::uint32_t id) const noexcept {
  constexpr std::uint32_t kAddress = kSecondBus | 0xFFU;
  return std::any_of(messages_.begin(), messages_.end(),
                     [id](const Message& other) { return other.number != 0 && ((other.id ^ id) & kAddress) == 0; });
}

CanFrame PacketSender::part(Message& message, Time now) noexcept {
  const std::uint8_t source = j1939::source_of(message.id), number = message.number;
  message.next_at = now + j1939::kPacketsApart;
  if (number == 0) {
    message.waits = false;
    message.sent = message.data;  // of one moment
    message.number = 1;
    return j1939::announcement_frame(j1939::group_of(message.id), source, message.bytes);
  }
  message.number = number == j1939::packets_of(message.bytes) ? std::uint8_t{0} : static_cast<std::uint8_t>(number + 1);
  return j1939::packet_frame(source, number, std::span(message.sent).first(message.bytes));
}

}  // namespace knuckle::sim
