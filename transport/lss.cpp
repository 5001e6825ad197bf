#include "transport/lss.h"

#include "transport/bytes.h"

namespace knuckle::lss {
namespace {

constexpr std::uint8_t kBytes = 8;  // of every message

bool known(Service service) noexcept {
  switch (service) {
    case Service::kSwitchAll:
    case Service::kConfigureNodeId:
    case Service::kStore:
    case Service::kSelectVendor:
    case Service::kSelectProduct:
    case Service::kSelectRevision:
    case Service::kSelectSerial:
    case Service::kSelected:
    case Service::kIdentifyVendor:
    case Service::kIdentifyProduct:
    case Service::kIdentifyRevisionLow:
    case Service::kIdentifyRevisionHigh:
    case Service::kIdentifySerialLow:
    case Service::kIdentifySerialHigh:
    case Service::kIdentifyUnconfigured:
    case Service::kIdentified:
    case Service::kUnconfigured:
    case Service::kAskVendor:
    case Service::kAskProduct:
    case Service::kAskRevision:
    case Service::kAskSerial:
    case Service::kAskNodeId:
      return true;
  }
  return false;
}

CanFrame frame_of(std::uint32_t id, Service service, std::uint32_t value) noexcept {
  CanFrame frame;
  frame.id = id;
  frame.size = kBytes;
  ByteWriter out(frame.data);
  out.put(static_cast<std::uint8_t>(service));
  out.put(value);
  return frame;
}

std::optional<Message> parse(std::uint32_t id, const CanFrame& frame) noexcept {
  if (frame.id != id || frame.size != kBytes) return std::nullopt;
  ByteReader in(frame.data);
  const auto service = static_cast<Service>(in.get<std::uint8_t>());
  if (!known(service)) return std::nullopt;
  return Message{service, in.get<std::uint32_t>()};
}

}  // namespace

CanFrame request(Service service, std::uint32_t value) noexcept {
  return frame_of(kRequestId, service, value);
}

CanFrame answer(Service service, std::uint32_t value) noexcept {
  return frame_of(kAnswerId, service, value);
}

std::optional<Message> parse_request(const CanFrame& frame) noexcept {
  return parse(kRequestId, frame);
}

std::optional<Message> parse_answer(const CanFrame& frame) noexcept {
  return parse(kAnswerId, frame);
}

const char* error_text(Service service, std::uint8_t error) noexcept {
  constexpr std::uint8_t kOwn = 0xFF;
  if (error == kOwn) return "for a reason of its own; see its manual";
  if (error == 1) return service == Service::kStore ? "it cannot store" : "it allows no such node id";
  if (error == 2 && service == Service::kStore) return "its memory cannot be written";
  return "unknown error code";
}

}  // namespace knuckle::lss
