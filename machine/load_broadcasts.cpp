#include "machine/load_broadcasts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/units.h"
#include "machine/bus_budget.h"
#include "machine/load_frames.h"
#include "machine/signal_units.h"
#include "transport/j1939.h"

namespace knuckle {
namespace {

constexpr double kSlowestStatus_s = 0.1;

bool is_measured(const SignalInfo& signal) noexcept {
  return signal.role != NodeRole::kValve && (signal.role != NodeRole::kEnable || is_status(signal));
}

const Unit& read_unit(TomlTable& file, const SignalInfo& signal) {
  std::vector<const char*> names;
  for (const Unit& unit : units_of(signal)) names.push_back(unit.name);
  return units_of(signal)[static_cast<std::size_t>(file.choice("unit", names))];
}

/// Of a position, as of nodes.
double largest_step(const SignalInfo& signal) noexcept {
  return is_angle(signal) ? 2 * std::numbers::pi / 512 : 5e-3;
}

constexpr double kLeastTravelSteps = 20;  // of a pilot pressure, between a shut spool and one at its full stroke

/// Of a pilot pressure: up to where the spool stays shut, and from where on it is at its full stroke.
void read_travel(TomlTable& file, const Unit& unit, BroadcastField& field) {
  constexpr double kMost = 1e9;
  field.shut_Pa = file.number("shut", 0, kMost) * unit.si;
  field.full_Pa = file.number("full", 0, kMost) * unit.si;
  file.require(field.full_Pa > field.shut_Pa, "full", "must be above shut", {"shut"});
}

/// @param key that says how coarse it is @param reach_Pa the most that it can say, @param reach_key that says so
void check_travel(const TomlTable& file, const Unit& unit, const BroadcastField& field, const char* key,
                  double reach_Pa, const char* reach_key) {
  constexpr double kSame = 1 + 1e-9;
  const double most_Pa = (field.full_Pa - field.shut_Pa) / kLeastTravelSteps;
  file.require(field.bits.type == BitField::Type::kFloat || std::abs(field.bits.scale) <= most_Pa * kSame, key,
               fmt::format("makes a step {} {}: must be at most {}, a {}th of full less shut",
                           number_text(std::abs(field.bits.scale) / unit.si), unit.name, number_text(most_Pa / unit.si),
                           number_text(kLeastTravelSteps)),
               {"unit", "shut", "full"});
  file.require(reach_Pa * kSame >= field.full_Pa, reach_key,
               fmt::format("reaches {} {}: must reach full, {}", number_text(reach_Pa / unit.si), unit.name,
                           number_text(field.full_Pa / unit.si)),
               {"unit", "full"});
}

/// Value = sign (raw * scale + offset) in the unit, + zero_rad.
void read_meaning(TomlTable& file, const SignalInfo& signal, const Unit& in, BitField& bits) {
  constexpr double kMost = 1e9;
  const double unit = in.si;
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
  if (signal.role == NodeRole::kEncoder && bits.type != BitField::Type::kFloat) {
    const double most = largest_step(signal) / unit;
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

/// By invalid_from or invalid; of a group what J1939 says of the length, where the file says nothing.
std::optional<std::uint64_t> read_invalid(TomlTable& file, const BitField& bits, bool is_group, std::int64_t most) {
  const bool has_kind = file.has("invalid");
  const bool by_length = has_kind ? file.choice("invalid", {"j1939", "none"}) == 0 : is_group;
  const bool is_unsigned = bits.type == BitField::Type::kUnsigned;
  if (file.has("invalid_from")) {
    const auto from = static_cast<std::uint64_t>(file.integer("invalid_from", 1, most));
    file.require(is_unsigned, "invalid_from", "only goes with type = \"unsigned\"", {"type"});
    file.require(!has_kind, "invalid", "stands beside invalid_from: keep one of the two");
    return from;
  }
  const auto from = by_length && is_unsigned ? j1939::invalid_from(bits.bits) : std::nullopt;
  file.require(from || !has_kind || !by_length, "invalid",
               "J1939 says it of unsigned values of 2, 4 and at least 8 bits: give invalid_from", {"bits", "type"});
  return from;
}

/// signal, range, and the counts and the values at the range's two ends.
BroadcastField read_input(TomlTable file, unsigned number, const SensorDescription& sensors) {
  using Counts = std::numeric_limits<std::int16_t>;
  constexpr double kMost = 1e9;
  std::vector<const char*> names;
  std::vector<std::size_t> places;
  for (std::size_t place = 0; place < kSignals.size(); ++place) {
    const bool people_alone = kSignals[place].role == NodeRole::kReading;
    if (!is_measured(kSignals[place]) || is_status(kSignals[place]) || people_alone) continue;
    names.push_back(kSignals[place].name);
    places.push_back(place);
  }
  BroadcastField field{
      .signal = static_cast<std::uint8_t>(places[static_cast<std::size_t>(file.choice("signal", names))]),
      .bits = {.type = BitField::Type::kSigned, .start_bit = analog_start_bit(number), .bits = kAnalogBits}};
  const SignalInfo& signal = field.info();
  AnalogSensor sensor;
  sensor.range = static_cast<AnalogSensor::Range>(file.choice("range", kAnalogRangeNames));
  const auto least = static_cast<double>(file.integer("counts_low", Counts::min(), Counts::max()));
  const auto most = static_cast<double>(file.integer("counts_high", Counts::min(), Counts::max()));
  file.require(least != most, "counts_high", "must not be counts_low", {"counts_low"});
  const Unit& in = read_unit(file, signal);
  const auto [unit_name, unit] = in;
  sensor.low = file.number("low", -kMost, kMost) * unit;
  sensor.high = file.number("high", -kMost, kMost) * unit;
  file.require(sensor.low != sensor.high, "high", "must not be low", {"low"});
  field.analog = sensor;
  const bool pilot = signal.role == NodeRole::kPilot;
  if (pilot) read_travel(file, in, field);
  if (!file.sound({"signal", "range", "counts_low", "counts_high", "unit", "low", "high", "shut", "full"}))
    return field;
  field.bits.scale = (sensor.high - sensor.low) / (most - least);
  field.bits.offset = sensor.low - least * field.bits.scale;
  const double lowest = value_of(field.bits, raw_of(field.bits, sensor.broken()));
  file.require(sensor.range == AnalogSensor::Range::k0To10V || sensor.is_broken(lowest), "counts_low",
               "leaves no counts for a broken wire", {"counts_high"});
  if (pilot) {
    check_travel(file, in, field, "counts_high", std::max(sensor.low, sensor.high), "high");
    return field;
  }
  const double step = std::abs(field.bits.scale);
  const bool pressure = signal.role == NodeRole::kPressure;
  const double coarsest = pressure ? sensors.pressure_step_Pa : largest_step(signal);
  file.require(step <= coarsest * (1 + 1e-9), "counts_high",
               fmt::format("makes a count {} {}: must be at most {}", number_text(step / unit), unit_name,
                           number_text(coarsest / unit)),
               {"counts_low", "low", "high", "unit"});
  file.require(!pressure || std::max(sensor.low, sensor.high) >= sensors.pressure_range_Pa * (1 - 1e-9), "high",
               fmt::format("must reach sensors.pressure_range_bar, {}", number_text(sensors.pressure_range_Pa / kBar)),
               {"low", "unit", ".sensors.pressure_range_bar"});
  return field;
}

/// Yes or no.
void read_status(TomlTable& file, BroadcastField& field, bool is_group) {
  const std::int64_t most = most_raw(file, field.bits);
  if (file.has("on")) field.on = static_cast<std::uint64_t>(file.integer("on", 0, most));
  field.invalid_from = read_invalid(file, field.bits, is_group, most);
  file.require(!field.invalid_from || field.on < *field.invalid_from, "on", "is said to be none by invalid_from",
               {"invalid_from"});
}

/// Of one frame, or of one message of several packets, in which all are little endian.
bool overlap(const BroadcastField& a, const BroadcastField& b) noexcept {
  if (a.first_byte == b.first_byte) return knuckle::overlap(a.bits, b.bits);
  const auto from = [](const BroadcastField& field) { return 8 * field.first_byte + field.bits.start_bit; };
  return from(a) < from(b) + b.bits.bits && from(b) < from(a) + a.bits.bits;
}

BroadcastField read_field(TomlTable file, std::size_t signal, const BroadcastFrame& frame,
                          const SensorDescription& sensors) {
  BroadcastField field{.signal = static_cast<std::uint8_t>(signal), .bits = {}};
  if (j1939::in_packets(frame.bytes)) {
    const MessageBits place = read_message_bits(file, frame.bytes);
    field.bits = place.bits;
    field.first_byte = place.first_byte;
  } else {
    field.bits = read_bits(file, frame.bytes);
  }
  if (is_yes_or_no(field.info())) {
    read_status(file, field, frame.is_group());
    return field;
  }
  const Unit& unit = read_unit(file, field.info());
  read_meaning(file, field.info(), unit, field.bits);
  const bool pilot = field.info().role == NodeRole::kPilot;
  if (pilot) read_travel(file, unit, field);
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  const std::int64_t most = field.bits.bits < 63 ? (std::int64_t{1} << field.bits.bits) - 1 : kMost;
  field.invalid_from = read_invalid(file, field.bits, frame.is_group(), most);
  if (field.info().role == NodeRole::kPressure) check_pressure(file, field, sensors);
  if (pilot && file.sound({"shut", "full", "scale", "unit"}))
    check_travel(file, unit, field, "scale", highest(field), "bits");
  return field;
}

class BroadcastReader {
 public:
  BroadcastReader(const BusDescription& bus, const SensorDescription& sensors) : bus_(bus), sensors_(sensors) {}

  void read(TomlTable& file, std::uint32_t bus) {
    BroadcastFrame frame = read_frame_head(file, all_, bus, true);
    read_signals(file.table("signals"), frame);
    if (j1939::in_packets(frame.bytes)) check_packets(file, frame);
    check_period(file, frame);
    file.require(!frame.source || frame.source != bus_.j1939_address, "source",
                 "is Knuckle's own address: bus.j1939_address must be one that nobody has", {".bus.j1939_address"});
    std::vector<UsedBits> used;
    for (const BroadcastField& field : frame.fields) used.push_back({field.bits, field.info().name});
    if (frame.multiplexer) used.push_back({frame.multiplexer->bits, "the multiplexer"});
    if (!j1939::in_packets(frame.bytes)) frame.closing = read_frame_closing(file, frame.bytes, used);
    check_closing(file, frame);
    all_.push_back(std::move(frame));
  }
  [[nodiscard]] std::vector<BroadcastFrame> take() { return std::move(all_); }

 private:
  static void check_packets(TomlTable& file, const BroadcastFrame& frame) {
    file.require(frame.only_readings(), "bytes",
                 "must be at most 8 of what moves the machine or stops it: several packets take too long", {"signals"});
    for (const char* key : {"counter", "checksum", "multiplexer"}) {
      if (!file.has(key)) continue;
      file.require(false, key, "does not go with a message of several packets", {"bytes"});
      file.leave(key);
    }
  }

  /// The counter runs over all frames of an identifier.
  void check_closing(const TomlTable& file, const BroadcastFrame& frame) const {
    for (const BroadcastFrame& other : all_) {
      if (other.id != frame.id || !frame.multiplexer) continue;
      const std::string same = "must be as of '" + other.name + "', which has the same identifier";
      file.require(other.closing.counter == frame.closing.counter, "counter", same);
      file.require(other.closing.checksum == frame.closing.checksum, "checksum", same);
      return;
    }
  }

  void check_period(const TomlTable& file, const BroadcastFrame& frame) const {
    const bool only_readings = frame.only_readings();
    if (frame.on_request) {
      file.require(only_readings, "request_every_s",
                   "is for values that people are told: what moves the machine or stops it must come by itself",
                   {"signals"});
      file.require(bus_.j1939_address.has_value(), "request_every_s",
                   "needs bus.j1939_address, which the answer is asked from", {".bus.j1939_address"});
    }
    if (only_readings) return;
    file.require(!leads(frame) || 2 * frame.period_s <= bus_.sensor_age_limit_s * (1 + 1e-9), "period_ms",
                 fmt::format("must be at most {}, half of bus.sensor_age_limit_ms",
                             number_text(bus_.sensor_age_limit_s / kMilli / 2)),
                 {".bus.sensor_age_limit_ms"});
    file.require(frame.period_s <= kSlowestStatus_s * (1 + 1e-9), "period_ms",
                 fmt::format("must be at most {}", number_text(kSlowestStatus_s / kMilli)));
  }

  void read_signals(TomlTable signals, BroadcastFrame& frame) {
    const std::vector<std::string> keys = signals.keys();
    if (keys.empty()) signals.require(false, "", "must have at least one signal");
    for (const std::string& key : keys) {
      const std::optional<std::size_t> place = measured_signal(key);
      if (!place) {
        signals.require(
            false, key,
            fmt::format("is no signal that is measured: must be one of {}", fmt::join(measured_signal_names(), ", ")));
        signals.leave(key);
        continue;
      }
      const BroadcastField field = read_field(signals.table(key), *place, frame, sensors_);
      if (signals.sound({key})) check_beside(signals, key, field, frame);
      frame.fields.push_back(field);
    }
  }

  /// Bits and signals are one value's alone; of a joint's length and angle there is one.
  void check_beside(const TomlTable& signals, const std::string& key, const BroadcastField& field,
                    const BroadcastFrame& frame) const {
    signals.require(!frame.multiplexer || !overlap(field.bits, frame.multiplexer->bits), key,
                    "has bits of the multiplexer");
    for (const BroadcastField& other : frame.fields)
      signals.require(!overlap(field, other), key, fmt::format("has bits of {}", other.info().name));
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

bool leads(const BroadcastFrame& frame) noexcept {
  return std::any_of(frame.fields.begin(), frame.fields.end(), [](const BroadcastField& field) {
    return field.info().role == NodeRole::kPilot || !is_optional(field.info());
  });
}

std::optional<std::size_t> measured_signal(const std::string& name) {
  for (std::size_t place = 0; place < kSignals.size(); ++place)
    if (kSignals[place].name == name && is_measured(kSignals[place])) return place;
  return std::nullopt;
}

std::vector<std::string> measured_signal_names() {
  std::vector<std::string> names;
  for (const SignalInfo& signal : kSignals)
    if (is_measured(signal)) names.emplace_back(signal.name);
  return names;
}

void check_pilots(const TomlTable& file, const BusDescription& bus) {
  const char* const key = file.has("broadcast") ? "broadcast" : "node";
  for (const SignalInfo& signal : kSignals) {
    if (signal.role != NodeRole::kPilot || bus.broadcast(NodeRole::kPilot, signal.index).field == nullptr) continue;
    file.require(bus.by_frames(), key,
                 fmt::format("{} goes with [[bus.command]] tables or a module's outputs: valve nodes tell where their "
                             "spools are",
                             signal.name),
                 {"command", "node"});
    const int other = signal.index ^ 1;
    const auto is_other = [other](const SignalInfo& one) { return one.role == NodeRole::kPilot && one.index == other; };
    file.require(bus.broadcast(NodeRole::kPilot, other).field != nullptr, key,
                 fmt::format("has {} without {}: of a joint there must be both or none", signal.name,
                             std::find_if(kSignals.begin(), kSignals.end(), is_other)->name),
                 {"node"});
  }
}

std::vector<BroadcastFrame> read_broadcasts(std::vector<TomlTable> files, std::vector<TomlTable> on_second,
                                            const BusDescription& bus, const SensorDescription& sensors) {
  BroadcastReader reader(bus, sensors);
  for (TomlTable& file : files) reader.read(file, 0);
  for (TomlTable& file : on_second) reader.read(file, kSecondBus);
  return reader.take();
}

std::vector<BroadcastFrame> read_inputs(TomlTable inputs, const NodeDescription& node, const BusDescription& bus,
                                        const SensorDescription& sensors) {
  std::vector<BroadcastFrame> frames;
  const std::vector<int> numbers = analog_numbers(inputs);
  if (numbers.empty()) inputs.require(false, "", "must have at least one input");
  for (const int one : numbers) {
    const auto number = static_cast<unsigned>(one);
    const std::uint8_t pdo = analog_pdo(number);
    if (frames.empty() || frames.back().pdo != pdo)
      frames.push_back({.name = fmt::format("{}_tpdo{}", node.name, pdo + 1),
                        .period_s = 1 / bus.sync_Hz,
                        .module = node.id,
                        .pdo = pdo});
    frames.back().fields.push_back(read_input(inputs.table(std::to_string(one)), number, sensors));
    frames.back().bytes = bytes_of(frames.back().fields.back().bits);
  }
  return frames;
}

}  // namespace knuckle
