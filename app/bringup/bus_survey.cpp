#include "app/bringup/bus_survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/units.h"
#include "machine/bus_frames.h"
#include "machine/description.h"
#include "machine/encoder_length.h"
#include "machine/signal_units.h"
#include "slave/jog.h"
#include "transport/lss.h"
#include "transport/signal_codec.h"
#include "transport/virtual_can.h"

namespace knuckle::bringup {

namespace {

using canopen::Object;

constexpr std::uint8_t kLastNode = 127;
constexpr std::size_t kAtOnce = 8;  // nodes whose answers are waited for side by side
// Request and response take half a millisecond at 500 kbit/s: an eighth of the bus load, beside other participants.
constexpr Duration kApart = 4ms;
const std::vector<Object> kStranger{canopen::kDeviceType, canopen::kVendorId, canopen::kProductCode,
                                    canopen::kSerialNumber, canopen::kErrorRegister};

/// Reads one node's objects one after the other.
class Reader {
 public:
  Reader(std::uint8_t node, std::vector<Object> objects) : node_(node), objects_(std::move(objects)) {}

  [[nodiscard]] std::uint8_t node() const noexcept { return node_; }
  [[nodiscard]] bool done() const noexcept { return next_ == objects_.size(); }
  [[nodiscard]] std::vector<ObjectRead> take() noexcept { return std::move(results_); }
  /// Answers beyond one to each request.
  [[nodiscard]] int second_answers() const noexcept { return std::max(0, answers_ - requests_); }

  /// @return whether a request was to be sent.
  bool step(CanBus& bus, Time now, Duration patience, bool may_ask) {
    if (done()) return false;
    const bool asks = may_ask && !asked_;
    if (asks) {
      if (wanted_at_ == kNever) wanted_at_ = now;
      asked_ = bus.send(canopen::sdo_upload(node_, objects_[next_]));
      if (asked_) ++requests_;
    }
    if (wanted_at_ != kNever && now - wanted_at_ >= patience) {
      const bool first = results_.empty();
      keep({objects_[next_], ObjectRead::Answer::kSilent, 0, canopen::SdoAbort::kNone});
      if (first) next_ = objects_.size();  // a node that does not answer the first request gets no other
    }
    return asks;
  }

  void receive(const CanFrame& frame) {
    const auto answer = canopen::parse_sdo_response(frame);
    if (done() || !answer) return;
    ++answers_;
    if (!asked_ || answer->object != objects_[next_]) return;
    using Kind = canopen::SdoResponse::Kind;
    ObjectRead read{objects_[next_], ObjectRead::Answer::kAborted, 0, canopen::SdoAbort::kUnknownCommand};
    if (answer->kind == Kind::kUploaded) read = {read.object, ObjectRead::Answer::kValue, answer->value, {}};
    if (answer->kind == Kind::kAborted) read.abort = answer->abort;
    keep(read);
  }

 private:
  void keep(const ObjectRead& read) {
    results_.push_back(read);
    ++next_;
    asked_ = false;
    wanted_at_ = kNever;
  }

  std::uint8_t node_;
  std::vector<Object> objects_;
  std::vector<ObjectRead> results_;
  std::size_t next_ = 0;
  int requests_ = 0, answers_ = 0;
  bool asked_ = false;
  Time wanted_at_ = kNever;  // also limits the wait for a bus that accepts no frame
};

class Surveyor {
 public:
  Surveyor(BusAccess& access, const SurveyOptions& options, const std::function<void()>& check)
      : access_(access), options_(options), check_(check) {
    found_.name = access.name();
  }

  /// What waited since the interface was opened tells of the nodes, but is no measure of the time that begins now.
  void listen(std::uint32_t bit_rate) {
    access_.wait_until(access_.now());  // the machine's other bus may have been looked at meanwhile
    hear_what_waits();
    errors_ = access_.bus().errors();
    const Time start = access_.now(), end = start + from_seconds(options_.listen_s);
    listening_ = true;
    while (access_.now() < end) tick();
    listening_ = false;
    found_.listened_s = to_seconds(access_.now() - start);
    std::uint64_t bits = 0;
    for (const auto& [id, frames] : found_.heard) bits += frames.bits;
    found_.load = static_cast<double>(bits) / (found_.listened_s * bit_rate);
  }

  void ask(std::vector<Reader> all) {
    std::size_t next = 0;
    while (next < all.size() || !busy_.empty()) {
      while (busy_.size() < kAtOnce && next < all.size()) busy_.push_back(std::move(all[next++]));
      tick();
      for (Reader& reader : busy_) {
        if (!reader.done()) continue;
        SurveyedNode& node = found_.nodes[reader.node()];
        node.second_answers = found_.others_ask ? 0 : reader.second_answers();
        node.objects = reader.take();
      }
      std::erase_if(busy_, [](const Reader& reader) { return reader.done(); });
    }
  }

  /// Any device without a node id answers; it does nothing else.
  void ask_for_devices_without_id() {
    const Time sent = access_.now();
    (void)access_.bus().send(lss::request(lss::Service::kIdentifyUnconfigured));
    while (access_.now() - sent < from_seconds(options_.answer_s)) tick();
  }

  [[nodiscard]] BusSurvey& found() noexcept { return found_; }
  [[nodiscard]] BusSurvey finish() {
    found_.state = access_.bus().state();
    found_.errors = access_.bus().errors() - errors_;
    for (auto& [id, node] : found_.nodes) node.id = id;
    return std::move(found_);
  }

 private:
  void tick() {
    if (check_) check_();
    access_.wait_until(access_.now() + 1ms);
    hear_what_waits();
    bool may_ask = access_.now() - asked_at_ >= kApart;
    for (Reader& reader : busy_) {
      if (!reader.step(access_.bus(), access_.now(), from_seconds(options_.answer_s), may_ask)) continue;
      may_ask = false;
      asked_at_ = access_.now();
    }
  }

  void hear_what_waits() {
    CanFrame frame;
    while (access_.bus().receive(frame)) hear(frame);
  }

  void note(const CanFrame& frame, HeardFrames& frames) const {
    frames.newest_at = access_.now();
    if (++frames.count == 1) frames.first_at = frames.newest_at;
    frames.bits += worst_case_bits(frame.size, frame.id);
    if (frame == frames.newest) ++frames.repeated;
    frames.newest = frame;
  }

  void hear(const CanFrame& frame) {
    if (listening_) {
      note(frame, found_.heard[frame.id]);
      for (const BroadcastFrame& one : options_.multiplexed)
        if (one.filter().lets(frame.id) && one.is_in(frame)) note(frame, found_.multiplexed[{frame.id, one.name}]);
    }
    found_.sync = found_.sync || frame.id == canopen::kSyncId;
    if (const auto answer = lss::parse_answer(frame); answer && answer->service == lss::Service::kUnconfigured)
      ++found_.without_id;
    const std::uint8_t id = canopen::node_of(frame.id);
    if (id == 0) return;
    if (canopen::function_of(frame.id) == canopen::sdo_request_id(0)) found_.others_ask = true;
    if (const auto state = canopen::parse_heartbeat(frame)) {
      SurveyedNode& node = found_.nodes[id];
      const bool boots = *state == canopen::NmtState::kBootUp;
      node.booted = node.booted || boots;
      node.state = boots ? canopen::NmtState::kPreOperational : *state;  // its state after the boot-up message
    } else if (const auto emergency = canopen::parse_emergency(frame)) {
      SurveyedNode& node = found_.nodes[id];
      node.emergency = *emergency;
      ++node.emergencies;
    }
    for (Reader& reader : busy_) {
      if (frame.id == canopen::sdo_response_id(reader.node())) reader.receive(frame);
    }
  }

  BusAccess& access_;
  const SurveyOptions& options_;
  const std::function<void()>& check_;
  BusSurvey found_;
  std::vector<Reader> busy_;
  Time asked_at_ = kNever;
  std::uint64_t errors_ = 0;  // before it listened
  bool listening_ = false;
};

}  // namespace

std::optional<double> HeardFrames::period_s() const noexcept {
  if (count < 2 || newest_at <= first_at) return std::nullopt;
  return to_seconds(newest_at - first_at) / static_cast<double>(count - 1);
}

const ObjectRead* SurveyedNode::read(Object object) const noexcept {
  const auto found =
      std::find_if(objects.begin(), objects.end(), [&](const ObjectRead& one) { return one.object == object; });
  return found == objects.end() ? nullptr : &*found;
}

std::optional<std::uint32_t> SurveyedNode::value(Object object) const noexcept {
  const ObjectRead* one = read(object);
  if (one == nullptr || one->answer != ObjectRead::Answer::kValue) return std::nullopt;
  return one->value;
}

bool SurveyedNode::answers() const noexcept {
  return std::any_of(objects.begin(), objects.end(),
                     [](const ObjectRead& one) { return one.answer != ObjectRead::Answer::kSilent; });
}

bool SurveyedNode::contradicts_itself() const noexcept {
  return std::any_of(objects.begin(), objects.end(), [this](const ObjectRead& one) {
    const ObjectRead& first = *read(one.object);
    using Answer = ObjectRead::Answer;
    return one.answer == Answer::kValue && first.answer == Answer::kValue && one.value != first.value;
  });
}

std::vector<BroadcastFrame> multiplexed_frames(const BusDescription& bus) {
  std::vector<BroadcastFrame> all;
  for (const BroadcastFrame& frame : bus.broadcasts)
    if (frame.multiplexer) all.push_back(frame);
  return all;
}

BusSurvey survey_bus(BusAccess& access, std::uint32_t bit_rate,
                     const std::map<std::uint8_t, std::vector<Object>>& wanted, const SurveyOptions& options,
                     const std::function<void()>& check) {
  Surveyor surveyor(access, options, check);
  surveyor.listen(bit_rate);
  // Two SDO clients of the same node would receive each other's responses.
  if (surveyor.found().others_ask) return surveyor.finish();
  std::vector<Reader> readers;
  for (const auto& [id, objects] : wanted) readers.emplace_back(id, objects);
  surveyor.ask(std::move(readers));
  readers = {};
  for (std::uint8_t id = 1; id <= kLastNode; ++id) {
    if (!wanted.contains(id)) readers.emplace_back(id, kStranger);
  }
  surveyor.ask(std::move(readers));
  surveyor.ask_for_devices_without_id();
  std::erase_if(surveyor.found().nodes, [&](const auto& entry) {
    const SurveyedNode& node = entry.second;
    return !wanted.contains(entry.first) && !node.answers() && !node.state && !node.emergency;
  });
  return surveyor.finish();
}

namespace {

NodeReading of_axis(const SurveyedNode& node, unsigned axis, const MachineDescription& machine) {
  const auto status = node.value(canopen::of_axis(canopen::kValveStatusWord, axis));
  const auto actual = node.value(canopen::of_axis(canopen::kValveActual, axis));
  if (!status || !actual) return {};
  const auto word = static_cast<std::uint16_t>(*status);
  const double spool = static_cast<std::int16_t>(*actual) / machine.bus.wire.valve_full_stroke;
  const auto state = canopen::valve_state(word);
  const char* name = !state                                     ? "?"
                     : *state == canopen::ValveState::kInit     ? "INIT"
                     : *state == canopen::ValveState::kDisabled ? "DISABLED"
                     : *state == canopen::ValveState::kHold     ? "HOLD"
                                                                : "ACTIVE";
  const std::string text = fmt::format("{}, spool {:.1f} %", name, 100 * spool);
  if ((word & canopen::kStatusLocal) != 0)
    return {text, "is in local mode: switch it to set-points from the bus", true};
  if (std::abs(spool) > 0.05)
    return {text,
            fmt::format("its spool is at {:.1f} % of stroke, at most 5 % expected: check spring, hand lever and "
                        "position sensor",
                        100 * spool),
            true};
  return {text, canopen::valve_fault(word) ? "is in its fault state; start-up resets the fault" : "", false};
}

/// Also where it is not mapped: most devices have it all the same.
Object pressure_status(const NodeChannel& channel) noexcept {
  return {canopen::kPressureStatus.index, channel.number};
}

/// One channel's.
NodeReading of_pressure(const SurveyedNode& node, const FrameField& value, double range_bar) {
  const auto raw = node.value(value.object);
  if (!raw) return {};
  const double bar = value_of(value.bits, *raw) / kBar;
  const std::string text = fmt::format("{:.2f} bar", bar);
  const std::uint32_t status = node.value(pressure_status(value.channel)).value_or(0);
  if ((status & (canopen::kPressureInvalid | canopen::kPressureOverload)) != 0)
    return {text, fmt::format("status 0x{:02X}, value invalid or overloaded: check transmitter and wiring", status),
            true};
  if (!(bar >= -3 && bar <= 1.05 * range_bar))
    return {
        text,
        fmt::format("{:.1f} bar is outside the range of 0 to {:.0f} bar: check transmitter and unit", bar, range_bar),
        true};
  return {text, "", false};
}

/// Of several channels all values, and the first complaint.
template <typename OfChannel>
NodeReading of_channels(const NodeDescription& expected, const OfChannel& of_channel) {
  NodeReading all;
  for (const NodeChannel& channel : expected.channels) {
    const NodeReading one = of_channel(channel);
    all.text += (all.text.empty() || one.text.empty() ? "" : ", ") + one.text;
    if (!all.complaint.empty() || one.complaint.empty()) continue;
    const bool several = expected.channels.size() > 1;
    all.complaint = (several ? std::string(channel.info().name) + ": " : "") + one.complaint;
    all.fault = one.fault;
  }
  return all;
}

NodeReading of_pressures(const SurveyedNode& node, const NodeDescription& expected, const MachineDescription& machine) {
  const std::vector<FrameField> fields = sent_fields(expected, machine);
  return of_channels(expected, [&](const NodeChannel& channel) {
    const FrameField* const value = find_field(fields, FrameField::Part::kValue, channel);
    return of_pressure(node, *value, machine.sensors.pressure_range_Pa / kBar);
  });
}

NodeReading of_encoder(const SurveyedNode& node, const NodeDescription& expected, const MachineDescription& machine) {
  const std::vector<FrameField> fields = sent_fields(expected, machine);
  const FrameField* const field = find_field(fields, FrameField::Part::kValue, expected.channels.front());
  const auto raw = node.value(field->object);
  if (!raw) return {};
  const double value = value_of(field->bits, *raw);
  const auto length_m = EncoderLengths(machine).length_m(expected.joint(), value);
  const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(expected.joint())];
  std::string text = length_m ? fmt::format("{:.4f} m", *length_m) : "no length";
  if (!slave::possible(*field, value, machine))
    return {text, "reports an impossible value: check the encoder and its wiring", true};
  if (expected.measures_angle())
    text += fmt::format(", {:.2f} deg", std::remainder(value, 2 * std::numbers::pi) / kDegree);
  constexpr double kTolerance_m = 0.01;
  const bool fits = length_m && *length_m >= cylinder.min_length_m - kTolerance_m &&
                    *length_m <= cylinder.max_length_m + kTolerance_m;
  if (fits) return {text, "", false};
  return {text,
          fmt::format("reads no length that its cylinder can have ({:.3f} to {:.3f} m): uncalibrated; knuckle "
                      "commission presets it",
                      cylinder.min_length_m, cylinder.max_length_m),
          false};
}

NodeReading of_tilt(const SurveyedNode& node, const NodeDescription& expected, const MachineDescription& machine) {
  const FrameField field = sent_fields(expected, machine).front();
  const auto raw = node.value(field.object);
  if (!raw) return {};
  const double slope_rad = value_of(field.bits, *raw);
  const bool possible = slave::possible(field, slope_rad, machine);
  return {fmt::format("{:.2f} deg", slope_rad / kDegree),
          possible ? "" : "reports an impossible slope: check the sensor and its wiring", !possible};
}

Object input_object(const BroadcastFrame& frame, const BroadcastField& field) noexcept {
  return {canopen::kAnalogInput.index, static_cast<std::uint8_t>(analog_number(frame.pdo, field.bits))};
}

/// All that its inputs measure, and the first broken wire.
NodeReading of_module(const SurveyedNode& node, const NodeDescription& expected, const MachineDescription& machine) {
  NodeReading all;
  for (const BroadcastFrame& frame : machine.bus.broadcasts) {
    for (const BroadcastField& field : frame.fields) {
      const auto raw = frame.module == expected.id ? node.value(input_object(frame, field)) : std::nullopt;
      if (!raw) continue;
      const double value = value_of(field.bits, *raw);
      all.text +=
          fmt::format("{}{} {}", all.text.empty() ? "" : ", ", field.info().name, value_text(field.info(), value));
      if (all.fault || !field.analog->is_broken(value)) continue;
      all.fault = true;
      all.complaint = fmt::format("{}: its wire is broken or has a short circuit: outside {}", field.info().name,
                                  kAnalogRangeNames[static_cast<std::size_t>(field.analog->range)]);
    }
  }
  return all;
}

NodeReading of_enable(const SurveyedNode& node) {
  const auto inputs = node.value(canopen::kEnableInputs);
  if (!inputs) return {};
  const bool closed = (*inputs & canopen::kInputEStopClosed) != 0, pilot = (*inputs & canopen::kInputPilotOn) != 0;
  const std::string text = fmt::format("E-stop chain {}, pilot {}", closed ? "closed" : "OPEN", pilot ? "ON" : "off");
  if (pilot) return {text, "pilot pressure is on: another controller is active, or the enable valve sticks open", true};
  if (!closed)
    return {text, "the E-stop chain is open, no motion is possible: release it on the machine when you are ready",
            false};
  return {text, "", false};
}

}  // namespace

std::vector<canopen::Object> reading_objects(const NodeDescription& node, const MachineDescription& machine) {
  std::vector<canopen::Object> objects;
  const std::vector<FrameField> fields = sent_fields(node, machine);
  for (const FrameField& field : fields) {
    if (field.part != FrameField::Part::kRate) objects.push_back(field.object);
  }
  for (const NodeChannel& channel : node.channels) {
    if (lacks_status(fields, channel)) objects.push_back(pressure_status(channel));
  }
  for (const BroadcastFrame& frame : machine.bus.broadcasts) {
    for (const BroadcastField& field : frame.fields)
      if (frame.module == node.id) objects.push_back(input_object(frame, field));
  }
  return objects;
}

NodeReading reading_of(const SurveyedNode& node, const NodeDescription& expected, const MachineDescription& machine) {
  switch (expected.role) {
    case NodeRole::kValve:
      return of_channels(expected, [&](const NodeChannel& axis) { return of_axis(node, axis.number, machine); });
    case NodeRole::kPressure:
      return of_pressures(node, expected, machine);
    case NodeRole::kEncoder:
      return of_encoder(node, expected, machine);
    case NodeRole::kTilt:
      return of_tilt(node, expected, machine);
    case NodeRole::kEnable:
      return of_enable(node);
    case NodeRole::kReading:
    case NodeRole::kPilot:
      break;
    case NodeRole::kModule:
      return of_module(node, expected, machine);
  }
  return {};
}

}  // namespace knuckle::bringup
