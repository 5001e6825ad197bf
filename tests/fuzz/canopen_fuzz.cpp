// Any CAN frame, sizes beyond 8 included: refused, or values that are finite and inside their physical range.
#include <algorithm>
#include <cmath>

#include "tests/fuzz/require.h"
#include "transport/canopen.h"

namespace {

using knuckle::test::require;

void check(const knuckle::CanFrame& frame) {
  namespace canopen = knuckle::canopen;
  if (const auto status = canopen::parse_valve_status(frame)) require(std::abs(status->spool) <= 2);
  if (const auto command = canopen::parse_valve_command(frame)) require(std::abs(command->set_point) <= 2);
  if (const auto reading = canopen::parse_pressure(frame)) require(std::isfinite(reading->pressure_Pa));
  if (const auto reading = canopen::parse_encoder(frame)) {
    require(std::isfinite(reading->position_m) && std::isfinite(reading->speed_mps));
  }
  if (const auto tilt = canopen::parse_tilt(frame)) require(std::isfinite(*tilt));
  if (const auto request = canopen::parse_sdo_request(frame)) require(request->size <= 4);
  if (const auto response = canopen::parse_sdo_response(frame)) {
    require(response->size <= 4 && canopen::abort_text(response->abort) != nullptr);
  }
  if (const auto emergency = canopen::parse_emergency(frame)) {
    require(canopen::emergency_text(emergency->code) != nullptr);
  }
  (void)canopen::parse_nmt(frame);
  (void)canopen::parse_heartbeat(frame);
  (void)canopen::parse_enable(frame);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3) return 0;
  knuckle::CanFrame frame;
  frame.id = static_cast<std::uint32_t>(data[0] | data[1] << 8) & 0x7FFU;
  frame.size = data[2];
  std::copy_n(data + 3, std::min(size - 3, frame.data.size()), frame.data.begin());
  check(frame);
  return 0;
}
