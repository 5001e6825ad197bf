#include "app/bringup/node_reading.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <numbers>

#include "machine/description.h"
#include "transport/canopen.h"

namespace knuckle::bringup {
namespace {

NodeReading of_valve(const SurveyedNode& node, const MachineDescription& machine) {
  const auto status = node.value(canopen::kValveStatusWord), actual = node.value(canopen::kValveActual);
  if (!status || !actual) return {};
  const auto word = static_cast<std::uint16_t>(*status);
  const double spool = static_cast<std::int16_t>(*actual) / machine.bus.wire.valve_full_stroke;
  const auto state = canopen::valve_state(word);
  const char* name = !state                                     ? "?"
                     : *state == canopen::ValveState::kInit     ? "INIT"
                     : *state == canopen::ValveState::kDisabled ? "DISABLED"
                     : *state == canopen::ValveState::kHold     ? "HOLD"
                                                                : "ACTIVE";
  NodeReading reading{fmt::format("{}, spool {:.1f} %", name, 100 * spool), "", false};
  if ((word & canopen::kStatusLocal) != 0) {
    reading.fault = true;
    reading.complaint = "is in local mode: switch it to set-points from the bus";
  } else if (std::abs(spool) > 0.05) {
    reading.fault = true;
    reading.complaint = fmt::format(
        "its spool is at {:.1f} % of stroke, at most 5 % expected: check spring, hand lever and position sensor",
        100 * spool);
  } else if (canopen::valve_fault(word)) {
    reading.complaint = "is in its fault state; start-up resets the fault";
  }
  return reading;
}

NodeReading of_pressure(const SurveyedNode& node, const MachineDescription& machine) {
  const WireDescription& wire = machine.bus.wire;
  const auto raw = node.value(wire.pressure_float ? canopen::kPressureFloat : canopen::kPressureValue);
  if (!raw) return {};
  const double value = wire.pressure_float ? double{std::bit_cast<float>(*raw)} : static_cast<std::int32_t>(*raw);
  const double bar = value * canopen::pressure_format(wire.pressure_float, wire.pressure_digits).unit_Pa / 1e5;
  NodeReading reading{fmt::format("{:.2f} bar", bar), "", false};
  const std::uint32_t status = node.value(canopen::kPressureStatus).value_or(0);
  const double range_bar = machine.sensors.pressure_range_Pa / 1e5;
  if ((status & (canopen::kPressureInvalid | canopen::kPressureOverload)) != 0) {
    reading = {reading.text,
               fmt::format("status 0x{:02X}, value invalid or overloaded: check transmitter and wiring", status), true};
  } else if (!(bar >= -3 && bar <= 1.05 * range_bar)) {
    reading = {
        reading.text,
        fmt::format("{:.1f} bar is outside the range of 0 to {:.0f} bar: check transmitter and unit", bar, range_bar),
        true};
  }
  return reading;
}

NodeReading of_encoder(const SurveyedNode& node, int joint, const MachineDescription& machine) {
  const auto steps = node.value(canopen::kEncoderPosition);
  if (!steps) return {};
  const double length_m = static_cast<std::int32_t>(*steps) * machine.sensors.encoder_step_m;
  const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(joint)];
  NodeReading reading{fmt::format("{:.4f} m", length_m), "", false};
  constexpr double kTolerance_m = 0.01;
  if (length_m < cylinder.min_length_m - kTolerance_m || length_m > cylinder.max_length_m + kTolerance_m) {
    reading.complaint = fmt::format(
        "reads no length that its cylinder can have ({:.3f} to {:.3f} m): uncalibrated; knuckle commission "
        "presets it",
        cylinder.min_length_m, cylinder.max_length_m);
  }
  return reading;
}

NodeReading of_tilt(const SurveyedNode& node, const MachineDescription& machine) {
  const auto steps = node.value(canopen::kTiltSlope);
  if (!steps) return {};
  const double deg = static_cast<std::int16_t>(*steps) * machine.sensors.tilt_step_rad * 180 / std::numbers::pi;
  return {fmt::format("{:.2f} deg", deg), "", false};
}

NodeReading of_enable(const SurveyedNode& node) {
  const auto inputs = node.value(canopen::kEnableInputs);
  if (!inputs) return {};
  const bool closed = (*inputs & canopen::kInputEStopClosed) != 0, pilot = (*inputs & canopen::kInputPilotOn) != 0;
  NodeReading reading{fmt::format("E-stop chain {}, pilot {}", closed ? "closed" : "OPEN", pilot ? "ON" : "off"), "",
                      false};
  if (pilot) {
    reading.fault = true;
    reading.complaint = "pilot pressure is on: another controller is active, or the enable valve sticks open";
  } else if (!closed) {
    reading.complaint = "the E-stop chain is open, no motion is possible: release it on the machine when you are ready";
  }
  return reading;
}

}  // namespace

std::vector<canopen::Object> reading_objects(NodeRole role, const MachineDescription& machine) {
  switch (role) {
    case NodeRole::kValve:
      return {canopen::kValveStatusWord, canopen::kValveActual};
    case NodeRole::kPressure:
      return {machine.bus.wire.pressure_float ? canopen::kPressureFloat : canopen::kPressureValue,
              canopen::kPressureStatus};
    case NodeRole::kEncoder:
      return {canopen::kEncoderPosition};
    case NodeRole::kTilt:
      return {canopen::kTiltSlope};
    case NodeRole::kEnable:
      return {canopen::kEnableInputs};
  }
  return {};
}

NodeReading reading_of(const SurveyedNode& node, const slave::NodeScript& expected, const MachineDescription& machine) {
  switch (expected.role) {
    case NodeRole::kValve:
      return of_valve(node, machine);
    case NodeRole::kPressure:
      return of_pressure(node, machine);
    case NodeRole::kEncoder:
      return of_encoder(node, expected.joint, machine);
    case NodeRole::kTilt:
      return of_tilt(node, machine);
    case NodeRole::kEnable:
      return of_enable(node);
  }
  return {};
}

}  // namespace knuckle::bringup
