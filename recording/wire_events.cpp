#include "recording/wire_events.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <utility>

#include "recording/cdr.h"
#include "recording/loop_tap.h"
#include "transport/bytes.h"
#include "transport/link_header.h"
#include "transport/link_messages.h"
#include "transport/machine_status.h"

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

// Since version 9: torque about the tip, its deviation, two covariances, six shares, and a byte for missing torques.
constexpr std::size_t kTorque = 10 * sizeof(double) + 1;

// Since version 11, of a status: of the first bus its state, of the second one load and state; and what ends it:
// errors, whose report is on the wire and how long, doubts.
constexpr std::size_t kBuses = 1 + sizeof(double) + 1, kBehindLoad = 4 + 8 + 8 + 2 + MachineName::kSize;

/// Both sound, the load all the first one's.
void add_buses(std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < kLinkHeaderSize + kBehindLoad) return;
  bytes.insert(bytes.end() - static_cast<std::ptrdiff_t>(kBehindLoad), kBuses, 0);
}

/// Of version 9. A status has twice as many bits of doubts, in front of the machine's name, which ends it.
void add_what_is_new(LinkKind kind, TranslatedDatagram& translated) {
  std::vector<std::uint8_t>& bytes = translated.bytes;
  if (kind == LinkKind::kSlave) {
    translated.made_up = kTorque;
    bytes.resize(bytes.size() + kTorque);
  }
  if (kind == LinkKind::kStatus && bytes.size() >= kLinkHeaderSize + MachineName::kSize)
    bytes.insert(bytes.end() - static_cast<std::ptrdiff_t>(MachineName::kSize), 0);
}

bool in_range(double value, double min, double max) noexcept {
  return value >= min && value <= max;
}

}  // namespace

std::optional<TranslatedDatagram> from_older_link(std::span<const std::uint8_t> datagram) {
  TranslatedDatagram translated{{datagram.begin(), datagram.end()}, false, 0};
  if (datagram.size() < kLinkHeaderSize) return std::nullopt;
  const std::uint8_t version = datagram[kVersionAt];
  if (version < kOldestLinkVersion || version >= kLinkVersion) return std::nullopt;
  translated.bytes[kVersionAt] = kLinkVersion;
  const auto kind = link_kind(translated.bytes);
  if (!kind) return std::nullopt;
  bool sound = true;
  if (version == 7) {
    if (left_out(*kind) > datagram.size() - kLinkHeaderSize) return std::nullopt;
    ByteReader in(datagram.last(left_out(*kind)));
    double impedance_Ns_per_m = 0;
    if (left_out(*kind) > 0) {
      sound = in_range(in.get<double>(), -kMostEnergy_J, kMostEnergy_J);
      if (kind == LinkKind::kMaster) impedance_Ns_per_m = in.get<float>();
      sound = in_range(impedance_Ns_per_m, 0, kMostImpedance_Ns_per_m) && sound;
      for (int axis = 0; axis < 2; ++axis) sound = in_range(in.get<double>(), -kMostWave, kMostWave) && sound;
      sound = in_range(in.get<double>(), 0, kMostEnergy_J) && sound;
    }
    translated.bytes.resize(datagram.size() - left_out(*kind));
    translated.led_by_waves = impedance_Ns_per_m > 0;
  }
  if (version < 9) add_what_is_new(*kind, translated);
  if (kind == LinkKind::kStatus) add_buses(translated.bytes);
  if (!sound || (kind == LinkKind::kMaster && !decode_master(translated.bytes))) return std::nullopt;
  return translated;
}

namespace {

constexpr std::array<const char*, static_cast<std::size_t>(WireEventKind::kCount)> kNames{
    "can_received", "can_sent",      "can_refused",   "can_state", "can_acknowledged", "hid_received",    "hid_sent",
    "hid_refused",  "hid_connected", "link_received", "link_sent", "link_refused",     "link_not_emptied"};

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c; });
  return text;
}

bool is_datagram(WireEventKind kind) noexcept {
  return kind == WireEventKind::kLinkReceived || kind == WireEventKind::kLinkSent ||
         kind == WireEventKind::kLinkRefused;
}

/// What an older link did not take, today's does not take either.
void translate(StepWires& wires) {
  wires.translated = std::make_shared<std::vector<std::vector<std::uint8_t>>>();
  for (WireEvent& event : wires.events) {
    auto translated = is_datagram(event.kind) ? from_older_link(event.data) : std::nullopt;
    if (!translated) continue;
    wires.led_by_waves |= translated->led_by_waves && event.kind == WireEventKind::kLinkReceived;
    event.made_up = translated->made_up;
    event.data = wires.translated->emplace_back(std::move(translated->bytes));  // a vector that moves keeps its bytes
  }
}

}  // namespace

const char* name(WireEventKind kind) noexcept {
  return kind < WireEventKind::kCount ? kNames[static_cast<std::size_t>(kind)] : "unknown";
}

std::string wires_schema() {
  std::string text =
      "# What one step of a loop read from its wires and wrote to them, in the order of its calls.\n"
      "int64 time_ns   # of the step, session clock\n"
      "uint32 step     # counts from 0\n"
      "uint32 crc      # CRC-32 of all bytes behind the number of events\n"
      "uint32 lost     # events for which there was no room\n"
      "WireEvent[] events\n" +
      std::string(80, '=') + "\nMSG: knuckle_msgs/WireEvent\n";
  for (std::size_t i = 0; i < kNames.size(); ++i) text += "uint8 " + upper(kNames[i]) + "=" + std::to_string(i) + "\n";
  return text + "uint8 kind\nuint32 value\nuint8[] data\n";
}

std::optional<StepWires> decode_wires(std::span<const std::uint8_t> message, int link_version) {
  CdrReader in(message);
  StepWires wires;
  wires.at = Time(Duration(in.get<std::int64_t>()));
  in.get(wires.step);
  in.get(wires.crc);
  in.get(wires.lost);
  const auto count = in.get<std::uint32_t>();
  if (!in.ok()) return std::nullopt;
  const auto events = message.subspan(in.at());
  wires.intact = libdeflate_crc32(0, events.data(), events.size()) == wires.crc;
  wires.events.reserve(std::min<std::size_t>(count, events.size()));
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    WireEvent event;
    event.kind = static_cast<WireEventKind>(in.get<std::uint8_t>());
    in.get(event.value);
    event.data = in.get_bytes();
    wires.events.push_back(event);
  }
  if (!in.ok()) return std::nullopt;
  wires.intact = wires.intact && in.at() == message.size();
  if (link_version < kLinkVersion) translate(wires);
  return wires;
}

CanFrame can_frame(const WireEvent& event) noexcept {
  CanFrame frame;
  frame.id = event.value;
  frame.size = static_cast<std::uint8_t>(std::min(event.data.size(), frame.data.size()));
  std::copy_n(event.data.begin(), frame.size, frame.data.begin());
  return frame;
}

}  // namespace knuckle::recording
