// What the machine's own controller sends of more than 8 bytes: announced to everybody, then in packets of 7 bytes each
// (J1939-21, transport protocol). Each address sends one message at a time; others of it wait.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/time.h"
#include "machine/bus_description.h"
#include "transport/can_bus.h"
#include "transport/j1939_packets.h"

namespace knuckle::sim {

class PacketSender {
 public:
  /// @param id of the group as it is sent: with its source and bus. @return place, for message() and send()
  std::size_t add(std::uint32_t id, std::uint8_t bytes);
  /// To be filled before send().
  [[nodiscard]] std::array<std::uint8_t, j1939::kMostMessage>& message(std::size_t which) noexcept {
    return messages_[which].data;
  }
  void send(std::size_t which) noexcept { messages_[which].waits = true; }
  /// This packet of each message is not sent; 0: all are.
  void lose(std::uint8_t packet) noexcept { lost_ = packet; }

  /// The frames that are due.
  template <typename Out>
  void step(Time now, Out& out) noexcept {
    for (Message& message : messages_)
      if (message.due(now, *this)) next(message, now, out);
  }

 private:
  struct Message {
    std::uint32_t id = 0;
    std::uint8_t bytes = 0;
    std::array<std::uint8_t, j1939::kMostMessage> data{}, sent{};
    bool waits = false;
    std::uint8_t number = 0;  ///< Of the packet that is next; 0: none.
    Time next_at = kNever;
    [[nodiscard]] bool due(Time now, const PacketSender& all) const noexcept {
      return number != 0 ? now >= next_at : waits && !all.busy(id);
    }
  };
  /// Whether another message of this address is under way.
  [[nodiscard]] bool busy(std::uint32_t id) const noexcept;
  template <typename Out>
  void next(Message& message, Time now, Out& out) noexcept {
    CanFrame frame = part(message, now);
    const bool is_lost = lost_ != 0 && frame.data[0] == lost_ && j1939::packet_number(frame);
    frame.id |= message.id & kSecondBus;
    if (!is_lost) out.push(frame);
  }
  /// The announcement, or the next packet.
  [[nodiscard]] static CanFrame part(Message& message, Time now) noexcept;

  std::vector<Message> messages_;
  std::uint8_t lost_ = 0;
};

}  // namespace knuckle::sim
