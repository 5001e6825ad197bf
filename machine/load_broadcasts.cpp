#include "machine/load_broadcasts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>

#include "core/units.h"
#include "machine/bus_budget.h"
#include "machine/reason_text.h"
#include "transport/canopen.h"

namespace knuckle {
namespace {

struct Unit {
  const char* name;
  double si;
};
constexpr std::array kPressureUnits{Unit{"bar", kBar}, Unit{"Pa", 1}, Unit{"kPa", 1e3}, Unit{"MPa", 1e6}};
constexpr std::array kLengthUnits{Unit{"mm", kMilli}, Unit{"m", 1}};
constexpr std::array kAngleUnits{Unit{"rad", 1}, Unit{"deg", kDegree}};

bool is_angle(const SignalInfo& signal) noexcept {
  return signal.is_angle || signal.role == NodeRole::kTilt;
}

std::span<const Unit> units_of(const SignalInfo& signal) noexcept {
  if (signal.role == NodeRole::kPressure) return kPressureUnits;
  if (is_angle(signal)) return kAngleUnits;
  return kLengthUnits;
}

/// Place in kSignals; its size where this is no signal that a frame of the machine may carry.
std::size_t measured_signal(const std::string& name) {
  const auto is_it = [&](const SignalInfo& signal) {
    return signal.name == name && signal.role != NodeRole::kValve && signal.role != NodeRole::kEnable;
  };
  return static_cast<std::size_t>(std::find_if(kSignals.begin(), kSignals.end(), is_it) - kSignals.begin());
}

BitField read_bits(TomlTable& file, std::uint8_t frame_bytes) {
  BitField bits;
  bits.start_bit = static_cast<std::uint8_t>(file.integer("start", 0, 63));
  bits.bits = static_cast<std::uint8_t>(file.integer("bits", 1, 64));
  if (file.has("type")) bits.type = static_cast<BitField::Type>(file.choice("type", {"unsigned", "signed", "float"}));
  if (file.has("order")) bits.order = static_cast<BitField::Order>(file.choice("order", {"little", "big"}));
  file.require(bits.type != BitField::Type::kFloat || bits.bits == 32 || bits.bits == 64, "bits",
               "must be 32 or 64 of a float", {"type"});
  file.require(bytes_of(bits) <= frame_bytes, "start",
               fmt::format("with {} bits it ends outside the frame's {} bytes", bits.bits, frame_bytes),
               {"bits", "order"});
  return bits;
}

/// Value = sign (raw * scale + offset) in the unit, + zero_rad.
void read_meaning(TomlTable& file, const SignalInfo& signal, BitField& bits) {
  constexpr double kMost = 1e9;
  std::vector<const char*> names;
  for (const Unit& unit : units_of(signal)) names.push_back(unit.name);
  const double unit = units_of(signal)[static_cast<std::size_t>(file.choice("unit", names))].si;
  const double scale = file.number("scale", -kMost, kMost);
  file.require(scale != 0, "scale", "must not be 0");
  const double offset = file.has("offset") ? file.number("offset", -kMost, kMost) : 0;
  double sign = 1, zero_rad = 0;
  if (is_angle(signal) && file.has("sign")) {
    sign = static_cast<double>(file.integer("sign", -1, 1));
    file.require(sign != 0, "sign", "must be 1 or -1");
  }
  if (is_angle(signal) && file.has("zero_rad"))
    zero_rad = file.number("zero_rad", -2 * std::numbers::pi, 2 * std::numbers::pi);
  constexpr double kLargestStep_rad = 2 * std::numbers::pi / 512, kLargestStep_m = 5e-3;  // as of nodes
  if (signal.role == NodeRole::kEncoder && bits.type != BitField::Type::kFloat) {
    const double most = (signal.is_angle ? kLargestStep_rad : kLargestStep_m) / unit;
    file.require(std::abs(scale) <= most, "scale", "must be at most " + number_text(most) + " a step",
                 {"unit", "type"});
  }
  bits.scale = sign * scale * unit;
  bits.offset = sign * offset * unit + zero_rad;
}

/// Of raw values that are values, and not the sign of none.
double highest(const BroadcastField& field) noexcept {
  const BitField& bits = field.bits;
  if (bits.type == BitField::Type::kFloat) return std::numeric_limits<double>::infinity();
  const bool is_signed = bits.type == BitField::Type::kSigned;
  const double span = std::ldexp(1.0, bits.bits - (is_signed ? 1 : 0));
  const double most = field.invalid_from ? static_cast<double>(*field.invalid_from) - 1 : span - 1;
  return std::max(most * bits.scale, (is_signed ? -span : 0) * bits.scale) + bits.offset;
}

void check_pressure(const TomlTable& file, const BroadcastField& field, const SensorDescription& sensors) {
  constexpr double kSame = 1 + 1e-9;
  const double step_Pa = std::abs(field.bits.scale);
  file.require(field.bits.type == BitField::Type::kFloat || step_Pa <= sensors.pressure_step_Pa * kSame, "scale",
               fmt::format("is {} bar a step: must be at most sensors.pressure_step_bar, {}",
                           number_text(step_Pa / kBar), number_text(sensors.pressure_step_Pa / kBar)),
               {"unit", ".sensors.pressure_step_bar"});
  file.require(highest(field) > kOverRange * sensors.pressure_range_Pa, "bits",
               fmt::format("reach {} bar: must reach {}, {} times sensors.pressure_range_bar",
                           number_text(highest(field) / kBar),
                           number_text(kOverRange * sensors.pressure_range_Pa / kBar), number_text(kOverRange)),
               {"unit", "scale", "offset", "invalid_from", ".sensors.pressure_range_bar"});
}

BroadcastField read_field(TomlTable file, std::size_t signal, std::uint8_t frame_bytes,
                          const SensorDescription& sensors) {
  BroadcastField field{
      .signal = static_cast<std::uint8_t>(signal), .bits = read_bits(file, frame_bytes), .invalid_from = {}};
  read_meaning(file, field.info(), field.bits);
  if (file.has("invalid_from")) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    const std::int64_t most = field.bits.bits < 63 ? (std::int64_t{1} << field.bits.bits) - 1 : kMost;
    field.invalid_from = static_cast<std::uint64_t>(file.integer("invalid_from", 1, most));
    file.require(field.bits.type == BitField::Type::kUnsigned, "invalid_from", "only goes with type = \"unsigned\"",
                 {"type"});
  }
  if (field.info().role == NodeRole::kPressure) check_pressure(file, field, sensors);
  return field;
}

FrameCounter read_counter(TomlTable file, std::uint8_t frame_bytes) {
  constexpr int kMostBits = 32;
  FrameCounter counter{.field = read_bits(file, frame_bytes), .modulus = 0};
  file.require(counter.field.type == BitField::Type::kUnsigned && counter.field.bits <= kMostBits, "bits",
               "must be at most 32 of an unsigned", {"type"});
  const std::int64_t most = std::int64_t{1} << std::min<int>(counter.field.bits, kMostBits);
  if (file.has("modulus")) counter.modulus = static_cast<std::uint64_t>(file.integer("modulus", 2, most));
  return counter;
}

/// Over all bytes of the frame but its own where the file does not say which.
FrameChecksum read_checksum(TomlTable file, std::uint8_t frame_bytes) {
  constexpr unsigned kByte = 8;
  FrameChecksum checksum;
  checksum.kind = static_cast<FrameChecksum::Kind>(file.choice("kind", {"sum", "xor", "crc8-j1850", "crc8-h2f"}));
  checksum.field = read_bits(file, frame_bytes);
  file.require(checksum.field.bits <= kByte, "bits", "must be at most 8", {"type"});
  const std::uint8_t own = checksum.field.start_bit / kByte;
  std::vector<double> bytes;
  if (file.has("bytes")) {
    bytes = file.list("bytes", 1, 8, 0, frame_bytes - 1.0);
  } else {
    for (std::uint8_t byte = 0; byte < frame_bytes; ++byte)
      if (byte != own) bytes.push_back(byte);
  }
  for (const double byte : bytes) {
    file.require(byte == std::floor(byte), "bytes", "must be whole numbers");
    file.require(byte != own || checksum.field.bits < kByte, "bytes",
                 "have the checksum's own: it cannot cover itself");
    checksum.bytes[checksum.byte_count++] = static_cast<std::uint8_t>(byte);
  }
  if (file.has("data_id")) {
    for (const double byte : file.list("data_id", 1, 2, 0, 255)) {
      file.require(byte == std::floor(byte), "data_id", "must be whole numbers");
      checksum.data_id[checksum.data_id_count++] = static_cast<std::uint8_t>(byte);
    }
    if (file.has("data_id_first")) checksum.data_id_first = file.boolean("data_id_first");
  }
  return checksum;
}

/// Of 29 bits where it needs them or is said to have them.
std::uint32_t read_id(TomlTable& file) {
  const auto id = static_cast<std::uint32_t>(file.integer("id", 0, kMostExtendedId));
  bool extended = id > kMostId;
  if (file.has("extended")) {
    const bool said = file.boolean("extended");
    file.require(said || !extended, "extended", fmt::format("must be true: id is above 0x{:03X}", kMostId), {"id"});
    extended = extended || said;
  }
  return extended ? id | kExtendedId : id;
}

void check_name(const TomlTable& file, const std::string& name, const std::vector<BroadcastFrame>& others) {
  constexpr std::size_t kLongest = 32;  // of a message in a DBC
  if (name.empty()) return;             // noted
  const bool plain =
      name.size() <= kLongest && std::isalpha(static_cast<unsigned char>(name.front())) != 0 &&
      std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
  file.require(plain, "name", "must be a letter and up to 31 letters, digits and _");
  const auto same = [&](const BroadcastFrame& other) { return other.name == name; };
  file.require(std::none_of(others.begin(), others.end(), same), "name", "is the name of another broadcast");
}

class BroadcastReader {
 public:
  BroadcastReader(const BusDescription& bus, const SensorDescription& sensors) : bus_(bus), sensors_(sensors) {}

  void read(TomlTable& file) {
    BroadcastFrame frame;
    frame.name = file.text("name");
    check_name(file, frame.name, all_);
    frame.id = read_id(file);
    const auto same = [&](const BroadcastFrame& other) { return other.id == frame.id; };
    const auto twin = std::find_if(all_.begin(), all_.end(), same);
    file.require(twin == all_.end(), "id", twin == all_.end() ? "" : "is taken by '" + twin->name + "'", {"extended"});
    frame.bytes = static_cast<std::uint8_t>(file.integer("bytes", 1, 8));
    frame.period_s = file.number("period_ms", 1, 1000, kMilli);
    file.require(2 * frame.period_s <= bus_.sensor_age_limit_s * (1 + 1e-9), "period_ms",
                 fmt::format("must be at most {}, half of bus.sensor_age_limit_ms",
                             number_text(bus_.sensor_age_limit_s / kMilli / 2)),
                 {".bus.sensor_age_limit_ms"});
    read_signals(file.table("signals"), frame);
    read_closing(file, frame);
    all_.push_back(std::move(frame));
  }
  [[nodiscard]] std::vector<BroadcastFrame> take() { return std::move(all_); }

 private:
  static void read_closing(TomlTable& file, BroadcastFrame& frame) {
    FrameClosing& closing = frame.closing;
    if (file.has("counter")) closing.counter = read_counter(file.table("counter"), frame.bytes);
    if (file.has("checksum")) closing.checksum = read_checksum(file.table("checksum"), frame.bytes);
    const auto apart = [&](const char* key, const BitField& bits, const BitField& other, const std::string& whose) {
      file.require(!overlap(bits, other), key, "has bits of " + whose);
    };
    for (const BroadcastField& field : frame.fields) {
      if (closing.counter) apart("counter", closing.counter->field, field.bits, field.info().name);
      if (closing.checksum) apart("checksum", closing.checksum->field, field.bits, field.info().name);
    }
    if (closing.counter && closing.checksum)
      apart("checksum", closing.checksum->field, closing.counter->field, "the counter");
  }

  void read_signals(TomlTable signals, BroadcastFrame& frame) {
    const std::vector<std::string> keys = signals.keys();
    if (keys.empty()) signals.require(false, "", "must have at least one signal");
    for (const std::string& key : keys) {
      const std::size_t place = measured_signal(key);
      if (place == kSignals.size()) {
        signals.require(
            false, key,
            "is no signal that is measured: must be such as boom_head_pressure, boom_angle, boom_length, slope");
        signals.leave(key);
        continue;
      }
      const BroadcastField field = read_field(signals.table(key), place, frame.bytes, sensors_);
      if (signals.sound({key})) check_beside(signals, key, field, frame);
      frame.fields.push_back(field);
    }
  }

  /// Bits and signals are one value's alone; of a joint's length and angle there is one.
  void check_beside(const TomlTable& signals, const std::string& key, const BroadcastField& field,
                    const BroadcastFrame& frame) const {
    for (const BroadcastField& other : frame.fields)
      signals.require(!overlap(field.bits, other.bits), key, fmt::format("has bits of {}", other.info().name));
    const auto look = [&](const BroadcastFrame& at) {
      for (const BroadcastField& other : at.fields) {
        if (other.info().role != field.info().role || other.info().index != field.info().index) continue;
        signals.require(false, key,
                        other.signal == field.signal
                            ? "is taken by '" + at.name + "'"
                            : fmt::format("'{}' has {}: of a joint's length and angle there must be one", at.name,
                                          other.info().name));
      }
    };
    look(frame);
    for (const BroadcastFrame& at : all_) look(at);
  }

  const BusDescription& bus_;
  const SensorDescription& sensors_;
  std::vector<BroadcastFrame> all_;
};

}  // namespace

std::vector<BroadcastFrame> read_broadcasts(std::vector<TomlTable> files, const BusDescription& bus,
                                            const SensorDescription& sensors) {
  BroadcastReader reader(bus, sensors);
  for (TomlTable& file : files) reader.read(file);
  return reader.take();
}

void check_broadcasts_beside_nodes(const TomlTable& file, const BusDescription& bus) {
  for (std::size_t i = 0; i < bus.broadcasts.size(); ++i) {
    const std::uint32_t id = bus.broadcasts[i].id;
    std::string whose;
    if (id == canopen::kNmtId) whose = "NMT";
    if (id == canopen::kSyncId) whose = "SYNC";
    if (id == canopen::heartbeat_id(bus.controller_id)) whose = "the controller's heartbeat";
    for (const NodeDescription& node : bus.nodes) {
      for (const std::uint32_t own : {canopen::emcy_id(node.id), canopen::sdo_response_id(node.id),
                                      canopen::sdo_request_id(node.id), canopen::heartbeat_id(node.id)})
        if (id == own) whose = "a service of '" + node.name + "'";
    }
    file.require(whose.empty(), fmt::format("broadcast[{}].id", i),
                 "has " + id_text(id) + ", the identifier of " + whose);
  }
}

}  // namespace knuckle
