#include "transport/hid_reports.h"

#include <boost/crc.hpp>
#include <span>

#include "transport/bytes.h"

namespace knuckle {
namespace {

// Report number and version lead, the CRC is in the last two bytes, what lies between is zero where unused.
constexpr std::size_t kBody = std::tuple_size_v<HidReport> - 2;
constexpr std::uint8_t kCommandFlags = 0;  // none is defined in version 1
constexpr std::uint8_t kSignBits = 0x07;

std::span<std::uint8_t> body(HidReport& report) noexcept {
  return std::span(report).first(kBody);
}

ByteWriter begin(HidReport& report, std::uint8_t number) noexcept {
  ByteWriter out(body(report));
  out.put(number);
  out.put(kHidVersion);
  return out;
}

void seal(HidReport& report) noexcept {
  ByteWriter(std::span(report).last<2>()).put(crc16_ccitt_false(report.data(), kBody));
}

bool authentic(const HidReport& report, std::uint8_t number) noexcept {
  const auto crc = ByteReader(std::span(report).last<2>()).get<std::uint16_t>();
  return report[0] == number && report[1] == kHidVersion && crc == crc16_ccitt_false(report.data(), kBody);
}

ByteReader fields(const HidReport& report) noexcept {
  return ByteReader(std::span(report).first(kBody).subspan(2));
}

template <typename T>
void put_each(ByteWriter& out, const PerJoint<T>& values) noexcept {
  for (const T value : values) out.put(value);
}

template <typename T>
void get_each(ByteReader& in, PerJoint<T>& values) noexcept {
  for (T& value : values) value = in.get<T>();
}

}  // namespace

std::uint16_t crc16_ccitt_false(const std::uint8_t* data, std::size_t size) noexcept {
  boost::crc_ccitt_type crc;  // polynomial 0x1021, start 0xFFFF, nothing reflected
  crc.process_bytes(data, size);
  return crc.checksum();
}

HidReport encode(const DeviceState& state) noexcept {
  HidReport report{};
  ByteWriter out = begin(report, kReportState);
  out.put(state.sequence);
  out.put(state.device_time_us);
  put_each(out, state.counts);
  put_each(out, state.counts_per_s);
  put_each(out, state.current_mA);
  out.put(state.status);
  out.put(state.fault);
  out.put(state.last_command_sequence);
  out.put(state.bus_mV);
  out.put(state.temperature_dC);
  seal(report);
  return report;
}

std::optional<DeviceState> decode_state(const HidReport& report) noexcept {
  if (!authentic(report, kReportState)) return std::nullopt;
  ByteReader in = fields(report);
  DeviceState state;
  state.sequence = in.get<std::uint16_t>();
  state.device_time_us = in.get<std::uint32_t>();
  get_each(in, state.counts);
  get_each(in, state.counts_per_s);
  get_each(in, state.current_mA);
  state.status = in.get<std::uint16_t>();
  state.fault = in.get<std::uint16_t>();
  state.last_command_sequence = in.get<std::uint16_t>();
  state.bus_mV = in.get<std::uint16_t>();
  state.temperature_dC = in.get<std::int16_t>();
  if ((state.status & ~kDeviceStatusBits) != 0 || (state.fault & ~kDeviceFaultBits) != 0) return std::nullopt;
  return state;
}

HidReport encode(const DeviceCommand& command) noexcept {
  HidReport report{};
  ByteWriter out = begin(report, kReportTorque);
  out.put(command.sequence);
  out.put(static_cast<std::uint8_t>(command.mode));
  out.put(command.flags);
  put_each(out, command.torque_permille);
  put_each(out, command.limit_permille);
  out.put(command.watchdog_ms);
  out.put(command.echoed_sequence);
  seal(report);
  return report;
}

std::optional<DeviceCommand> decode_command(const HidReport& report) noexcept {
  if (!authentic(report, kReportTorque)) return std::nullopt;
  ByteReader in = fields(report);
  DeviceCommand command;
  command.sequence = in.get<std::uint16_t>();
  const auto mode = in.get<std::uint8_t>();
  command.flags = in.get<std::uint8_t>();
  get_each(in, command.torque_permille);
  get_each(in, command.limit_permille);
  command.watchdog_ms = in.get<std::uint16_t>();
  command.echoed_sequence = in.get<std::uint16_t>();
  if (mode > static_cast<std::uint8_t>(TorqueMode::kTorque) || (command.flags & ~kCommandFlags) != 0) {
    return std::nullopt;
  }
  command.mode = static_cast<TorqueMode>(mode);
  return command;
}

HidReport encode(const DeviceIdentity& identity) noexcept {
  HidReport report{};
  ByteWriter out = begin(report, kReportDescription);
  put_each(out, identity.counts_per_turn);
  put_each(out, identity.gear_ratio);
  put_each(out, identity.torque_constant_Nm_per_A);
  put_each(out, identity.rated_current_mA);
  unsigned reversed = 0;  // bit j set: joint j counts against its angle
  for (std::size_t j = 0; j < kJoints; ++j) reversed |= (identity.joint_sign[j] < 0 ? 1U : 0U) << j;
  out.put(static_cast<std::uint8_t>(reversed));
  put_each(out, identity.zero_counts);
  out.put(identity.serial);
  seal(report);
  return report;
}

std::optional<DeviceIdentity> decode_identity(const HidReport& report) noexcept {
  if (!authentic(report, kReportDescription)) return std::nullopt;
  ByteReader in = fields(report);
  DeviceIdentity identity;
  get_each(in, identity.counts_per_turn);
  get_each(in, identity.gear_ratio);
  get_each(in, identity.torque_constant_Nm_per_A);
  get_each(in, identity.rated_current_mA);
  const unsigned reversed = in.get<std::uint8_t>();
  get_each(in, identity.zero_counts);
  identity.serial = in.get<std::uint32_t>();
  if (!in.ok() || (reversed & ~unsigned{kSignBits}) != 0) return std::nullopt;
  for (std::size_t j = 0; j < kJoints; ++j) {
    identity.joint_sign[j] = ((reversed >> j) & 1U) != 0 ? std::int8_t{-1} : std::int8_t{1};
    const bool usable = identity.counts_per_turn[j] > 0 && identity.gear_ratio[j] > 0 &&
                        identity.torque_constant_Nm_per_A[j] > 0 && identity.rated_current_mA[j] > 0;
    if (!usable) return std::nullopt;
  }
  return identity;
}

HidReport encode_describe_request() noexcept {
  HidReport report{};
  begin(report, kReportDescribe);
  seal(report);
  return report;
}

bool is_describe_request(const HidReport& report) noexcept {
  return authentic(report, kReportDescribe);
}

}  // namespace knuckle
