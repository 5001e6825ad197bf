#include "recording/older_links.h"

#include "transport/bytes.h"
#include "transport/link_kind.h"
#include "transport/link_messages.h"

namespace knuckle::recording {
namespace {

constexpr std::size_t kVersionAt = 2;
// Of a wave: its integral, x and z, and its energy; in front of the operator's, its impedance.
constexpr std::size_t kWave = 3 * sizeof(double), kImpedance = sizeof(float);
constexpr double kMostWave = 1e12, kMostEnergy_J = 1e15, kMostImpedance_Ns_per_m = 1e9;

std::size_t left_out(LinkKind kind) noexcept {
  return kind == LinkKind::kMaster ? kImpedance + kWave : kind == LinkKind::kSlave ? kWave : 0;
}

bool within(double value, double min, double max) noexcept {
  return value >= min && value <= max;
}

}  // namespace

std::optional<TranslatedDatagram> from_link_version_7(std::span<const std::uint8_t> datagram) {
  TranslatedDatagram translated{{datagram.begin(), datagram.end()}, false};
  if (datagram.size() < kLinkHeaderSize || datagram[kVersionAt] != 7) return std::nullopt;
  translated.bytes[kVersionAt] = kLinkVersion;
  const auto kind = link_kind(translated.bytes);
  if (!kind || left_out(*kind) > datagram.size() - kLinkHeaderSize) return std::nullopt;
  ByteReader in(datagram.last(left_out(*kind)));
  const double impedance_Ns_per_m = kind == LinkKind::kMaster ? in.get<float>() : 0.0;
  bool sound = within(impedance_Ns_per_m, 0, kMostImpedance_Ns_per_m);
  if (left_out(*kind) > 0) {
    for (int axis = 0; axis < 2; ++axis) sound = within(in.get<double>(), -kMostWave, kMostWave) && sound;
    sound = within(in.get<double>(), 0, kMostEnergy_J) && sound;
  }
  translated.bytes.resize(datagram.size() - left_out(*kind));
  if (!sound || (kind == LinkKind::kMaster && !decode_master(translated.bytes))) return std::nullopt;
  translated.led_by_waves = impedance_Ns_per_m > 0;
  return translated;
}

}  // namespace knuckle::recording
