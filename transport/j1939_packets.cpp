#include "transport/j1939_packets.h"

#include <algorithm>

namespace knuckle::j1939 {
namespace {

constexpr std::uint8_t kAnnounces = 32, kReserved = 0xFF;

bool is_for_everybody(std::uint32_t group, const CanFrame& frame) noexcept {
  return frame.size == 8 && CanFilter(identifier(group, 0), kAllButPriorityAndSource).lets(frame.id);
}

}  // namespace

std::optional<Announcement> announced(const CanFrame& frame) noexcept {
  if (!is_for_everybody(kConnection, frame) || frame.data[0] != kAnnounces) return std::nullopt;
  const Announcement said{
      .group = (frame.data[5] | std::uint32_t{frame.data[6]} << 8 | std::uint32_t{frame.data[7]} << 16) & kMostGroup,
      .bytes = static_cast<std::uint16_t>(frame.data[1] | frame.data[2] << 8),
      .packets = frame.data[3]};
  const bool fits = said.bytes >= kLeastMessage && said.packets == packets_of(said.bytes);
  return fits ? std::optional(said) : std::nullopt;
}

std::optional<std::uint8_t> packet_number(const CanFrame& frame) noexcept {
  if (!is_for_everybody(kTransfer, frame) || frame.data[0] == 0) return std::nullopt;
  return frame.data[0];
}

CanFrame announcement_frame(std::uint32_t group, std::uint8_t source, std::size_t bytes) noexcept {
  const auto byte = [](std::size_t value) { return static_cast<std::uint8_t>(value); };
  return {.id = identifier(kConnection, source, kEverybody, 7),
          .size = 8,
          .data = {kAnnounces, byte(bytes), byte(bytes >> 8), byte(packets_of(static_cast<unsigned>(bytes))), kReserved,
                   byte(group), byte(group >> 8), byte(group >> 16)}};
}

CanFrame packet_frame(std::uint8_t source, std::uint8_t number, std::span<const std::uint8_t> message) noexcept {
  CanFrame frame{.id = identifier(kTransfer, source, kEverybody, 7), .size = 8, .data = {}};
  frame.data.fill(kReserved);
  frame.data[0] = number;
  const std::size_t from = std::min<std::size_t>((number - 1U) * kPacketBytes, message.size());
  const auto part = message.subspan(from, std::min<std::size_t>(kPacketBytes, message.size() - from));
  std::copy(part.begin(), part.end(), frame.data.begin() + 1);
  return frame;
}

void PacketReader::begin(const Announcement& announcement, Time now) noexcept {
  bytes_ = announcement.bytes;
  packets_ = announcement.packets;
  next_ = 1;
  whole_ = 0;
  newest_at_ = now;
}

std::optional<PacketReader::Lost> PacketReader::add(std::uint8_t number, const CanFrame& frame, Time now) noexcept {
  if (!under_way()) return std::nullopt;
  if (number != next_ || late(now)) return end();
  newest_at_ = now;
  const std::size_t from = (number - 1U) * kPacketBytes;
  for (std::size_t i = 0; i < kPacketBytes && from + i < data_.size(); ++i) data_[from + i] = frame.data[i + 1];
  if (number == packets_) {
    whole_ = std::min<std::size_t>(bytes_, data_.size());
    next_ = 0;
  } else {
    ++next_;
  }
  return std::nullopt;
}

std::optional<PacketReader::Lost> PacketReader::end() noexcept {
  if (!under_way()) return std::nullopt;
  const Lost lost{next_, packets_};
  next_ = 0;
  return lost;
}

}  // namespace knuckle::j1939
