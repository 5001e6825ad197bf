// Sensors' process data as single transmitters send them, written and read by the tests' own means.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/units.h"
#include "transport/canopen.h"

namespace knuckle::canopen {

namespace sensor_detail {

template <typename T>
void put(CanFrame& frame, T value) {
  auto raw = static_cast<std::uint32_t>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i, raw >>= 8) frame.data[frame.size++] = static_cast<std::uint8_t>(raw);
}

inline std::uint32_t get(const CanFrame& frame, std::size_t at, std::size_t bytes) {
  std::uint32_t raw = 0;
  for (std::size_t i = bytes; i-- > 0;) raw = raw << 8 | frame.data[at + i];
  return raw;
}

}  // namespace sensor_detail

inline constexpr double kPressureStep_Pa = 1000;       ///< 0.01 bar
inline constexpr double kEncoderSpeedStep_mps = 1e-4;  ///< 0x6005:02 = 10

struct PressureReading {
  double pressure_Pa = 0;
  std::uint8_t status = 0;
};
/// What a value of 1 means, and whether it is an integer or a float.
struct PressureFormat {
  double unit_Pa = kPressureStep_Pa;
  bool is_float = false;
  std::size_t bytes = 4;  ///< 2: 0x7130
};
/// 0x9130 with so many decimal digits of a bar, or 0x6130 in bar.
inline PressureFormat pressure_format(bool is_float, int digits) {
  return {is_float ? kBar : kBar / std::pow(10, digits), is_float};
}

/// A channel more at the frame's end.
inline void add_pressure(CanFrame& frame, const PressureReading& reading, const PressureFormat& format) {
  const double value = reading.pressure_Pa / format.unit_Pa;
  if (format.is_float)
    sensor_detail::put(frame, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
  else if (format.bytes == 2)
    sensor_detail::put(frame, to_steps<std::int16_t>(reading.pressure_Pa, format.unit_Pa));
  else
    sensor_detail::put(frame, to_steps<std::int32_t>(reading.pressure_Pa, format.unit_Pa));
  sensor_detail::put(frame, reading.status);
}

inline CanFrame pressure_frame(std::uint32_t cob_id, const PressureReading& reading,
                               const PressureFormat& format = {}) {
  CanFrame frame{.id = cob_id};
  add_pressure(frame, reading, format);
  return frame;
}

/// @param place of the channel in its frame
inline std::optional<PressureReading> parse_pressure(const CanFrame& frame, const PressureFormat& format = {},
                                                     std::size_t place = 0) {
  const std::size_t at = place * (format.bytes + 1), status = at + format.bytes;
  if (frame.size <= status) return std::nullopt;
  const std::uint32_t raw = sensor_detail::get(frame, at, format.bytes);
  const double value = format.is_float     ? double{std::bit_cast<float>(raw)}
                       : format.bytes == 2 ? static_cast<std::int16_t>(raw)
                                           : static_cast<std::int32_t>(raw);
  return PressureReading{value * format.unit_Pa, frame.data[status]};
}

struct EncoderReading {
  double position_m = 0;
  double speed_mps = 0;
};

inline CanFrame encoder_frame(std::uint32_t cob_id, const EncoderReading& reading, double step_m = kEncoderStep_m,
                              double speed_step_mps = kEncoderSpeedStep_mps) {
  CanFrame frame{.id = cob_id};
  sensor_detail::put(frame, to_steps<std::int32_t>(reading.position_m, step_m));
  sensor_detail::put(frame, to_steps<std::int16_t>(reading.speed_mps, speed_step_mps));
  return frame;
}

inline std::optional<EncoderReading> parse_encoder(const CanFrame& frame, double step_m = kEncoderStep_m,
                                                   double speed_step_mps = kEncoderSpeedStep_mps) {
  if (frame.size < 6) return std::nullopt;
  const double position_m = static_cast<std::int32_t>(sensor_detail::get(frame, 0, 4)) * step_m;
  return EncoderReading{position_m, static_cast<std::int16_t>(sensor_detail::get(frame, 4, 2)) * speed_step_mps};
}

inline CanFrame tilt_frame(std::uint32_t cob_id, double slope_rad, double step_rad = kTiltStep_rad) {
  CanFrame frame{.id = cob_id};
  sensor_detail::put(frame, to_steps<std::int16_t>(slope_rad, step_rad));
  return frame;
}

inline std::optional<double> parse_tilt(const CanFrame& frame, double step_rad = kTiltStep_rad) {
  if (frame.size < 2) return std::nullopt;
  return static_cast<std::int16_t>(sensor_detail::get(frame, 0, 2)) * step_rad;
}

}  // namespace knuckle::canopen
