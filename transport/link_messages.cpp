#include "transport/link_messages.h"

#include <array>

#include "transport/link_codec.h"

namespace knuckle {

const char* limit_word(unsigned bit) noexcept {
  constexpr std::array<const char*, 11> kWords{"full stroke",  "valve speed",   "joint range", "virtual wall",
                                               "pressure",     "power",         "pump flow",   "joint velocity",
                                               "assist force", "force ceiling", "home on two"};
  return bit < kWords.size() ? kWords[bit] : nullptr;
}

const char* name(Mode mode) noexcept {
  switch (mode) {
    case Mode::kOff:
      return "off";
    case Mode::kSelfTest:
      return "self_test";
    case Mode::kReady:
      return "ready";
    case Mode::kAligning:
      return "aligning";
    case Mode::kEngaged:
      return "engaged";
    case Mode::kHold:
      return "hold";
    case Mode::kFault:
      return "fault";
    case Mode::kEStop:
      return "e_stop";
  }
  return "?";
}

Datagram encode(const MasterMessage& message) noexcept {
  return link_codec::encode(message, LinkKind::kMaster);
}
Datagram encode(const SlaveMessage& message) noexcept {
  return link_codec::encode(message, LinkKind::kSlave);
}
Datagram encode(const HomeMessage& message) noexcept {
  return link_codec::encode(message, LinkKind::kHome);
}
std::optional<MasterMessage> decode_master(std::span<const std::uint8_t> bytes) noexcept {
  return link_codec::decode<MasterMessage>(bytes, LinkKind::kMaster);
}
std::optional<SlaveMessage> decode_slave(std::span<const std::uint8_t> bytes) noexcept {
  return link_codec::decode<SlaveMessage>(bytes, LinkKind::kSlave);
}
std::optional<HomeMessage> decode_home(std::span<const std::uint8_t> bytes) noexcept {
  return link_codec::decode<HomeMessage>(bytes, LinkKind::kHome);
}

}  // namespace knuckle
