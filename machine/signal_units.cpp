#include "machine/signal_units.h"

#include <fmt/format.h>

#include <array>
#include <numbers>

#include "core/units.h"

namespace knuckle {
namespace {

constexpr std::array kPressureUnits{Unit{"bar", kBar}, Unit{"Pa", 1}, Unit{"kPa", 1e3}, Unit{"MPa", 1e6}};
constexpr std::array kLengthUnits{Unit{"mm", kMilli}, Unit{"m", 1}};
constexpr std::array kAngleUnits{Unit{"rad", 1}, Unit{"deg", kDegree}};
constexpr std::array kSpeedUnits{Unit{"rpm", std::numbers::pi / 30}, Unit{"rad/s", 1}};
constexpr std::array kTemperatureUnits{Unit{"degC", 1}};
constexpr std::array kTimeUnits{Unit{"h", 3600}, Unit{"s", 1}};
constexpr std::array kVoltageUnits{Unit{"V", 1}};
constexpr std::array kShareUnits{Unit{"%", 0.01}};

/// By SignalInfo::index.
constexpr std::array<std::span<const Unit>, 7> kReadingUnits{
    kSpeedUnits, {}, kTemperatureUnits, kTemperatureUnits, kTimeUnits, kVoltageUnits, kShareUnits};

}  // namespace

std::span<const Unit> units_of(const SignalInfo& signal) noexcept {
  if (is_yes_or_no(signal)) return {};
  if (signal.role == NodeRole::kReading) return kReadingUnits[static_cast<std::size_t>(signal.index)];
  if (signal.role == NodeRole::kPressure || signal.role == NodeRole::kPilot) return kPressureUnits;
  if (is_angle(signal)) return kAngleUnits;
  return kLengthUnits;
}

const Unit& shown_unit(const SignalInfo& signal) noexcept {
  const bool is_length = signal.role == NodeRole::kEncoder && !signal.is_angle;
  return is_length ? kLengthUnits.back() : units_of(signal).front();
}

std::string value_text(const SignalInfo& signal, double value) {
  if (is_yes_or_no(signal)) return value != 0 ? "yes" : "no";
  const Unit& unit = shown_unit(signal);
  const bool fine = unit.si == 1 && (is_angle(signal) || signal.role == NodeRole::kEncoder);
  return fmt::format("{:.{}f} {}", value / unit.si, fine ? 3 : 1, unit.name);
}

}  // namespace knuckle
