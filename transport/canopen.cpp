#include "transport/canopen.h"

#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/units.h"
#include "transport/bytes.h"

namespace knuckle::canopen {
namespace {

/// Fills a frame field by field.
template <typename... Fields>
CanFrame frame_of(std::uint32_t id, Fields... fields) noexcept {
  CanFrame frame;
  frame.id = id;
  ByteWriter out(frame.data);
  (out.put(fields), ...);
  frame.size = static_cast<std::uint8_t>(out.size());
  return frame;
}

CanFrame sdo_frame(std::uint32_t id, unsigned command, Object object, std::uint32_t value) noexcept {
  return frame_of(id, static_cast<std::uint8_t>(command), object.index, object.subindex, value);
}

// Expedited transfer, size given: bits 1 and 0; number of unused bytes: bits 3 and 2.
unsigned size_bits(std::uint8_t size) noexcept {
  return 0x3U | ((4U - size) & 0x3U) << 2;
}

std::uint32_t masked(std::uint32_t value, std::uint8_t size) noexcept {
  return size >= 4 ? value : value & ((1U << (8U * size)) - 1U);
}

struct Text {
  std::uint32_t code;
  const char* text;
};

constexpr std::array kEmergencyTexts{
    Text{0x0000, "error reset or no error"},
    Text{0x5030, "sensor error"},
    Text{0x8110, "CAN overrun, objects lost"},
    Text{0x8120, "CAN in error passive mode"},
    Text{0x8130, "heartbeat of a watched node missing"},
    Text{0x8140, "recovered from bus off"},
    Text{0x8150, "CAN identifier collision"},
    Text{0x8210, "PDO not processed: too short"},
    Text{0x8220, "PDO too long"},
    Text{0x8250, "RPDO timeout"},
};
constexpr std::array kEmergencyClasses{
    Text{0x10, "generic error"},
    Text{0x20, "current"},
    Text{0x21, "current, input side"},
    Text{0x22, "current inside the device"},
    Text{0x23, "current, output side"},
    Text{0x30, "voltage"},
    Text{0x31, "mains voltage"},
    Text{0x32, "voltage inside the device"},
    Text{0x33, "output voltage"},
    Text{0x40, "temperature"},
    Text{0x41, "ambient temperature"},
    Text{0x42, "device temperature"},
    Text{0x50, "device hardware"},
    Text{0x60, "device software"},
    Text{0x61, "internal software"},
    Text{0x62, "user software"},
    Text{0x63, "data set"},
    Text{0x70, "additional modules"},
    Text{0x80, "monitoring"},
    Text{0x81, "communication"},
    Text{0x82, "protocol error"},
    Text{0x90, "external error"},
    Text{0xF0, "additional functions"},
    Text{0xFF, "device specific"},
};
constexpr std::array kAbortTexts{
    Text{0x05030000, "toggle bit not alternated"},
    Text{0x05040000, "SDO protocol timed out"},
    Text{0x05040001, "command specifier unknown"},
    Text{0x05040005, "out of memory"},
    Text{0x06010000, "unsupported access to an object"},
    Text{0x06010001, "object is write-only"},
    Text{0x06010002, "object is read-only"},
    Text{0x06020000, "object does not exist"},
    Text{0x06040041, "object cannot be mapped to the PDO"},
    Text{0x06040042, "mapped objects exceed the PDO's length"},
    Text{0x06040043, "parameters are incompatible"},
    Text{0x06040047, "internal incompatibility in the device"},
    Text{0x06060000, "hardware error"},
    Text{0x06070010, "length does not match"},
    Text{0x06070012, "length too high"},
    Text{0x06070013, "length too low"},
    Text{0x06090011, "subindex does not exist"},
    Text{0x06090030, "value out of range"},
    Text{0x06090031, "value too high"},
    Text{0x06090032, "value too low"},
    Text{0x08000000, "general error"},
    Text{0x08000020, "data cannot be stored"},
    Text{0x08000021, "data cannot be stored: local control"},
    Text{0x08000022, "data cannot be stored: device state"},
};

template <std::size_t N>
const char* look_up(const std::array<Text, N>& texts, std::uint32_t code) noexcept {
  for (const Text& entry : texts) {
    if (entry.code == code) return entry.text;
  }
  return nullptr;
}

}  // namespace

CanFrame nmt_frame(NmtCommand command, std::uint8_t node) noexcept {
  return frame_of(kNmtId, static_cast<std::uint8_t>(command), node);
}

std::optional<NmtRequest> parse_nmt(const CanFrame& frame) noexcept {
  if (frame.id != kNmtId || frame.size != 2 || frame.data[1] > 127) return std::nullopt;
  const auto command = static_cast<NmtCommand>(frame.data[0]);
  switch (command) {
    case NmtCommand::kStart:
    case NmtCommand::kStop:
    case NmtCommand::kEnterPreOperational:
    case NmtCommand::kResetNode:
    case NmtCommand::kResetCommunication:
      return NmtRequest{command, frame.data[1]};
  }
  return std::nullopt;
}

CanFrame sync_frame() noexcept {
  return frame_of(kSyncId);
}

CanFrame heartbeat_frame(std::uint8_t node, NmtState state) noexcept {
  return frame_of(heartbeat_id(node), static_cast<std::uint8_t>(state));
}

std::optional<NmtState> parse_heartbeat(const CanFrame& frame) noexcept {
  if (function_of(frame.id) != heartbeat_id(0) || node_of(frame.id) == 0 || frame.size != 1) return std::nullopt;
  const auto state = static_cast<NmtState>(frame.data[0] & 0x7F);  // bit 7 is the toggle of node guarding
  switch (state) {
    case NmtState::kBootUp:
    case NmtState::kStopped:
    case NmtState::kOperational:
    case NmtState::kPreOperational:
      return state;
  }
  return std::nullopt;
}

CanFrame emergency_frame(std::uint8_t node, const Emergency& e) noexcept {
  return frame_of(emcy_id(node), e.code, e.error_register, e.vendor[0], e.vendor[1], e.vendor[2], e.vendor[3],
                  e.vendor[4]);
}

std::optional<Emergency> parse_emergency(const CanFrame& frame) noexcept {
  if (function_of(frame.id) != kSyncId || node_of(frame.id) == 0 || frame.size != 8) return std::nullopt;
  ByteReader in(frame.data);
  Emergency emergency;
  emergency.code = in.get<std::uint16_t>();
  emergency.error_register = in.get<std::uint8_t>();
  for (auto& byte : emergency.vendor) byte = in.get<std::uint8_t>();
  return emergency;
}

const char* emergency_text(std::uint16_t code) noexcept {
  if (const char* text = look_up(kEmergencyTexts, code)) return text;
  if (const char* text = look_up(kEmergencyClasses, code >> 8)) return text;
  return "unknown error code";
}

const char* abort_text(SdoAbort code) noexcept {
  const char* text = look_up(kAbortTexts, static_cast<std::uint32_t>(code));
  return text != nullptr ? text : "unknown abort code";
}

CanFrame sdo_download(std::uint8_t node, Object object, std::uint32_t value, std::uint8_t size) noexcept {
  return sdo_frame(sdo_request_id(node), 0x20U | size_bits(size), object, masked(value, size));
}

CanFrame sdo_upload(std::uint8_t node, Object object) noexcept {
  return sdo_frame(sdo_request_id(node), 0x40U, object, 0);
}

CanFrame sdo_abandoned(std::uint8_t node, Object object, SdoAbort code) noexcept {
  return sdo_frame(sdo_request_id(node), 0x80U, object, static_cast<std::uint32_t>(code));
}

CanFrame sdo_downloaded(std::uint8_t node, Object object) noexcept {
  return sdo_frame(sdo_response_id(node), 0x60U, object, 0);
}

CanFrame sdo_uploaded(std::uint8_t node, Object object, std::uint32_t value, std::uint8_t size) noexcept {
  return sdo_frame(sdo_response_id(node), 0x40U | size_bits(size), object, masked(value, size));
}

CanFrame sdo_aborted(std::uint8_t node, Object object, SdoAbort code) noexcept {
  return sdo_frame(sdo_response_id(node), 0x80U, object, static_cast<std::uint32_t>(code));
}

std::optional<SdoResponse> parse_sdo_response(const CanFrame& frame) noexcept {
  if (function_of(frame.id) != sdo_response_id(0) || frame.size != 8) return std::nullopt;
  ByteReader in(frame.data);
  const unsigned command = in.get<std::uint8_t>();
  SdoResponse response;
  response.object.index = in.get<std::uint16_t>();
  response.object.subindex = in.get<std::uint8_t>();
  const auto value = in.get<std::uint32_t>();
  switch (command >> 5) {
    case 2:  // upload
      if ((command & 0x2U) == 0) {
        response.kind = SdoResponse::Kind::kNotExpedited;
        return response;
      }
      response.kind = SdoResponse::Kind::kUploaded;
      response.size = static_cast<std::uint8_t>((command & 0x1U) != 0 ? 4U - (command >> 2 & 0x3U) : 4U);
      response.value = masked(value, response.size);
      return response;
    case 3:
      response.kind = SdoResponse::Kind::kDownloaded;
      return response;
    case 4:
      response.kind = SdoResponse::Kind::kAborted;
      response.abort = static_cast<SdoAbort>(value);
      return response;
    default:
      response.kind = SdoResponse::Kind::kNotExpedited;
      return response;
  }
}

std::optional<SdoRequest> parse_sdo_request(const CanFrame& frame) noexcept {
  if (function_of(frame.id) != sdo_request_id(0) || frame.size != 8) return std::nullopt;
  ByteReader in(frame.data);
  const unsigned command = in.get<std::uint8_t>();
  SdoRequest request;
  request.object.index = in.get<std::uint16_t>();
  request.object.subindex = in.get<std::uint8_t>();
  const auto value = in.get<std::uint32_t>();
  switch (command >> 5) {
    case 1:
      if ((command & 0x2U) == 0) return request;  // segmented
      request.kind = SdoRequest::Kind::kDownload;
      request.size = static_cast<std::uint8_t>((command & 0x1U) != 0 ? 4U - (command >> 2 & 0x3U) : 0U);
      request.value = request.size == 0 ? value : masked(value, request.size);
      return request;
    case 2:
      request.kind = SdoRequest::Kind::kUpload;
      return request;
    case 4:
      request.kind = SdoRequest::Kind::kAbort;
      return request;
    default:
      return request;
  }
}

std::optional<ValveState> valve_state(std::uint16_t status_word) noexcept {
  const auto state = static_cast<ValveState>(status_word & 0x7);
  switch (state) {
    case ValveState::kInit:
    case ValveState::kDisabled:
    case ValveState::kHold:
    case ValveState::kActive:
      return state;
  }
  return std::nullopt;
}

template <typename T>
T to_steps(double value, double step) noexcept {
  const double steps = std::round(value / step);
  if (std::isnan(steps)) return 0;
  if (steps <= double{std::numeric_limits<T>::min()}) return std::numeric_limits<T>::min();
  if (steps >= double{std::numeric_limits<T>::max()}) return std::numeric_limits<T>::max();
  return static_cast<T>(steps);
}
template std::int16_t to_steps<std::int16_t>(double, double) noexcept;
template std::int32_t to_steps<std::int32_t>(double, double) noexcept;

CanFrame valve_status_frame(std::uint32_t cob_id, const ValveStatus& status, double full_stroke) noexcept {
  return frame_of(cob_id, status.status_word, to_steps<std::int16_t>(status.spool, 1 / full_stroke));
}

std::optional<ValveStatus> parse_valve_status(const CanFrame& frame, double full_stroke) noexcept {
  if (frame.size < bytes_of(kValveTpdo)) return std::nullopt;
  ByteReader in(frame.data);
  const auto word = in.get<std::uint16_t>();
  return ValveStatus{word, in.get<std::int16_t>() / full_stroke};
}

CanFrame valve_command_frame(std::uint32_t cob_id, const ValveCommand& command, double full_stroke) noexcept {
  return frame_of(cob_id, command.control_word, to_steps<std::int16_t>(command.set_point, 1 / full_stroke));
}

std::optional<ValveCommand> parse_valve_command(const CanFrame& frame, double full_stroke) noexcept {
  if (frame.size < bytes_of(kValveRpdo)) return std::nullopt;
  ByteReader in(frame.data);
  const auto word = in.get<std::uint16_t>();
  return ValveCommand{word, in.get<std::int16_t>() / full_stroke};
}

std::uint32_t encoder_step_object(double step_m) noexcept {
  return static_cast<std::uint32_t>(std::lround(step_m / 1e-9));
}

std::uint32_t tilt_step_object(double step_rad) noexcept {
  return static_cast<std::uint32_t>(std::lround(step_rad * 180 / std::numbers::pi / 1e-3));
}

CanFrame enable_inputs_frame(std::uint32_t cob_id, std::uint8_t inputs) noexcept {
  return frame_of(cob_id, inputs);
}

CanFrame enable_output_frame(std::uint32_t cob_id, std::uint8_t outputs) noexcept {
  return frame_of(cob_id, outputs);
}

std::optional<std::uint8_t> parse_enable(const CanFrame& frame) noexcept {
  if (frame.size < bytes_of(kEnableTpdo)) return std::nullopt;
  return frame.data[0];
}

}  // namespace knuckle::canopen
