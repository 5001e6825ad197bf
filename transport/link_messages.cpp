#include "transport/link_messages.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "transport/link_codec.h"

namespace knuckle {
namespace {

using link_codec::begin;
using link_codec::BoundedReader;
using link_codec::kStampSize;
using link_codec::open;
using link_codec::put;
using link_codec::put_each;

constexpr std::size_t kReasonSize = 11;
constexpr std::size_t kMasterSize = kLinkHeaderSize + kStampSize + 8 + 2 * 4 + 1 + kReasonSize + 8 * 8 + 4 + 8;
constexpr std::size_t kSlaveSize =
    kLinkHeaderSize + kStampSize + 8 + 1 + 2 * kReasonSize + 9 * 8 + 4 * 8 + 3 * 8 + 2 * 8 + 1 + 2 + 6 * 8 + 2 * 8 + 8;
constexpr std::uint8_t kMasterFlags = 0x3F;
// No honest number comes near these; within them no sum, square or difference in the loops overflows.
constexpr double kMostAngle_rad = 10, kMostRate_radps = 200;
constexpr double kMostForce_N = 1e8, kMostCovariance_N2 = 1e16;
constexpr double kMostPressure_Pa = 1e10, kMostMass_kg = 1e9, kMostEnergy_J = 1e15;

/// A reason may carry the very NaN it complains of; it must still get through, so it is sent as the largest number.
float sendable(float value) noexcept {
  return std::isfinite(value) ? value : std::copysign(std::numeric_limits<float>::max(), value);
}

void put(ByteWriter& out, const Reason& reason) noexcept {
  out.put(static_cast<std::uint16_t>(reason.code));
  out.put(reason.subject);
  out.put(sendable(reason.value));
  out.put(sendable(reason.limit));
}

/// @return false where the code is unknown.
bool get(ByteReader& in, Reason& reason) noexcept {
  const auto code = in.get<std::uint16_t>();
  if (code >= static_cast<std::uint16_t>(ReasonCode::kCount)) return false;
  reason.code = static_cast<ReasonCode>(code);
  reason.subject = in.get<std::uint8_t>();
  reason.value = in.get<float>();
  reason.limit = in.get<float>();
  return true;
}

}  // namespace

const char* limit_word(unsigned bit) noexcept {
  constexpr std::array<const char*, 10> kWords{"full stroke",  "valve speed",  "joint range", "virtual wall",
                                               "pressure",     "power",        "pump flow",   "joint velocity",
                                               "assist force", "force ceiling"};
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
  Datagram datagram;
  ByteWriter out = begin(datagram, LinkKind::kMaster, kMasterSize);
  put(out, message.stamp);
  put(out, message.device_report_at);
  out.put(message.stops);
  out.put(message.releases);
  const unsigned flags = (message.presence ? 1U : 0U) | (message.enable ? 2U : 0U) | (message.clutch ? 4U : 0U) |
                         (message.stop ? 8U : 0U) | (message.device_ok ? 16U : 0U) |
                         (message.assist.stop_on_object ? 32U : 0U);
  out.put(static_cast<std::uint8_t>(flags));
  put(out, message.device_reason);
  put_each(out, message.position_rad);
  put_each(out, message.velocity_radps);
  put_each(out, message.rendered_N, kMostForce_N);
  out.put(static_cast<float>(std::clamp(message.assist.force_limit_N, -2 * kMostForce_N, 2 * kMostForce_N)));
  out.put(message.energy_in_J);
  return datagram;
}

std::optional<MasterMessage> decode_master(std::span<const std::uint8_t> bytes) noexcept {
  auto in = open(bytes, LinkKind::kMaster, kMasterSize);
  if (!in) return std::nullopt;
  MasterMessage message;
  BoundedReader bounded(*in);
  message.stamp = bounded.stamp();
  message.device_report_at = bounded.time();
  message.stops = in->get<std::uint32_t>();
  message.releases = in->get<std::uint32_t>();
  const unsigned flags = in->get<std::uint8_t>();
  message.presence = (flags & 1U) != 0;
  message.enable = (flags & 2U) != 0;
  message.clutch = (flags & 4U) != 0;
  message.stop = (flags & 8U) != 0;
  message.device_ok = (flags & 16U) != 0;
  message.assist.stop_on_object = (flags & 32U) != 0;
  const bool known = get(*in, message.device_reason);
  bounded.each(message.position_rad, kMostAngle_rad);
  bounded.each(message.velocity_radps, kMostRate_radps);
  bounded.each(message.rendered_N, kMostForce_N);
  message.assist.force_limit_N = bounded.single(0, kMostForce_N);
  message.energy_in_J = bounded.number(-kMostEnergy_J, kMostEnergy_J);
  if (!known || (flags & ~unsigned{kMasterFlags}) != 0 || !bounded.ok()) return std::nullopt;
  return message;
}

Datagram encode(const SlaveMessage& message) noexcept {
  Datagram datagram;
  ByteWriter out = begin(datagram, LinkKind::kSlave, kSlaveSize);
  put(out, message.stamp);
  put(out, message.sensor_at);
  out.put(static_cast<std::uint8_t>(message.mode));
  put(out, message.blocking);
  put(out, message.fault);
  put_each(out, message.position_rad);
  put_each(out, message.velocity_radps);
  put_each(out, message.ahead_rad);
  put_each(out, message.tip_force_N, kMostForce_N);
  put_each(out, message.load_N, kMostForce_N);
  put_each(out, message.covariance_N2, kMostCovariance_N2);
  out.put(message.confidence);
  out.put(message.contact_compliance);
  out.put(static_cast<std::uint8_t>(message.contact ? 1 : 0));
  out.put(message.limits);
  put_each(out, message.pressure_Pa);
  out.put(message.payload_kg);
  out.put(message.payload_sigma_kg);
  out.put(message.energy_in_J);
  return datagram;
}

std::optional<SlaveMessage> decode_slave(std::span<const std::uint8_t> bytes) noexcept {
  auto in = open(bytes, LinkKind::kSlave, kSlaveSize);
  if (!in) return std::nullopt;
  SlaveMessage message;
  BoundedReader bounded(*in);
  message.stamp = bounded.stamp();
  message.sensor_at = bounded.time();
  const auto mode = in->get<std::uint8_t>();
  const bool known = get(*in, message.blocking) && get(*in, message.fault);
  bounded.each(message.position_rad, kMostAngle_rad);
  bounded.each(message.velocity_radps, kMostRate_radps);
  bounded.each(message.ahead_rad, kMostAngle_rad);
  bounded.each(message.tip_force_N, kMostForce_N);
  bounded.each(message.load_N, kMostForce_N);
  bounded.each(message.covariance_N2, kMostCovariance_N2);
  message.confidence = bounded.number(0, 1);
  message.contact_compliance = bounded.number(0, 1);
  const auto contact = in->get<std::uint8_t>();
  message.limits = in->get<std::uint16_t>();
  bounded.each(message.pressure_Pa, kMostPressure_Pa);
  message.payload_kg = bounded.number(-kMostMass_kg, kMostMass_kg);
  message.payload_sigma_kg = bounded.number(0, kMostMass_kg);
  message.energy_in_J = bounded.number(-kMostEnergy_J, kMostEnergy_J);
  const bool in_range =
      known && mode <= static_cast<std::uint8_t>(Mode::kEStop) && contact <= 1 && (message.limits & ~kLimitBits) == 0;
  if (!in_range || !bounded.ok()) return std::nullopt;
  message.mode = static_cast<Mode>(mode);
  message.contact = contact == 1;
  return message;
}

}  // namespace knuckle
