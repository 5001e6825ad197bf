#include "recording/older_links.h"

#include "transport/bytes.h"
#include "transport/link_header.h"
#include "transport/link_messages.h"

namespace knuckle::recording {
namespace {

constexpr std::size_t kVersionAt = 2;
// At the end of version 7's messages: an energy, in front of the operator's wave its impedance, and the wave: its
// integral, x and z, and its energy.
constexpr std::size_t kEnergy = sizeof(double), kImpedance = sizeof(float), kWave = 3 * sizeof(double);
constexpr double kMostWave = 1e12, kMostEnergy_J = 1e15, kMostImpedance_Ns_per_m = 1e9;

std::size_t left_out(LinkKind kind) noexcept {
  if (kind == LinkKind::kMaster) return kEnergy + kImpedance + kWave;
  return kind == LinkKind::kSlave ? kEnergy + kWave : 0;
}

bool in_range(double value, double min, double max) noexcept {
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
  double impedance_Ns_per_m = 0;
  bool sound = true;
  if (left_out(*kind) > 0) {
    sound = in_range(in.get<double>(), -kMostEnergy_J, kMostEnergy_J);
    if (kind == LinkKind::kMaster) impedance_Ns_per_m = in.get<float>();
    sound = in_range(impedance_Ns_per_m, 0, kMostImpedance_Ns_per_m) && sound;
    for (int axis = 0; axis < 2; ++axis) sound = in_range(in.get<double>(), -kMostWave, kMostWave) && sound;
    sound = in_range(in.get<double>(), 0, kMostEnergy_J) && sound;
  }
  translated.bytes.resize(datagram.size() - left_out(*kind));
  if (!sound || (kind == LinkKind::kMaster && !decode_master(translated.bytes))) return std::nullopt;
  translated.led_by_waves = impedance_Ns_per_m > 0;
  return translated;
}

}  // namespace knuckle::recording
