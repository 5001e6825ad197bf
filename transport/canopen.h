// CANopen (CiA 301) frames and the CiA 404/406/408/410/401 objects of the machine bus: plain constants and functions
// that both ends use. SI at the interface, little-endian steps on the wire; no state and no time in here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>

#include "transport/can_bus.h"

namespace knuckle::canopen {

// ---- Identifiers of the pre-defined connection set
// -------------------------------------------------------------------
inline constexpr std::uint32_t kNmtId = 0x000;
inline constexpr std::uint32_t kSyncId = 0x080;
[[nodiscard]] constexpr std::uint32_t emcy_id(std::uint8_t node) noexcept {
  return 0x080U + node;
}
[[nodiscard]] constexpr std::uint32_t tpdo1_id(std::uint8_t node) noexcept {
  return 0x180U + node;
}
/// @param number 1 to 4.
[[nodiscard]] constexpr std::uint32_t tpdo_id(std::uint8_t node, unsigned number) noexcept {
  return tpdo1_id(node) + 0x100U * (number - 1);
}
[[nodiscard]] constexpr std::uint32_t rpdo1_id(std::uint8_t node) noexcept {
  return 0x200U + node;
}
/// @param number 1 to 4.
[[nodiscard]] constexpr std::uint32_t rpdo_id(std::uint8_t node, unsigned number) noexcept {
  return rpdo1_id(node) + 0x100U * (number - 1);
}
[[nodiscard]] constexpr std::uint32_t sdo_response_id(std::uint8_t node) noexcept {
  return 0x580U + node;
}
[[nodiscard]] constexpr std::uint32_t sdo_request_id(std::uint8_t node) noexcept {
  return 0x600U + node;
}
[[nodiscard]] constexpr std::uint32_t heartbeat_id(std::uint8_t node) noexcept {
  return 0x700U + node;
}
/// The function part of an identifier, such as 0x180, and the node part. An identifier of 29 bits has another function
/// than any of CANopen's.
[[nodiscard]] constexpr std::uint32_t function_of(std::uint32_t id) noexcept {
  return id & ~0x7FU;
}
[[nodiscard]] constexpr std::uint8_t node_of(std::uint32_t id) noexcept {
  return static_cast<std::uint8_t>(id & 0x7FU);
}

// ---- Objects
// ---------------------------------------------------------------------------------------------------------
struct Object {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  bool operator==(const Object&) const = default;
};
/// Of a device with several axes: the profile's object of this one, from 1 to 8 (CiA 301, multiple device modules).
[[nodiscard]] constexpr Object of_axis(Object object, unsigned axis) noexcept {
  return {static_cast<std::uint16_t>(object.index + 0x800U * (axis - 1)), object.subindex};
}
// CiA 301
inline constexpr Object kDeviceType{0x1000, 0}, kErrorRegister{0x1001, 0};
inline constexpr Object kConsumerHeartbeat{0x1016, 1};  ///< u32: node << 16 | time in ms
/// What an operational node does on a communication error: 0 goes pre-operational, 1 stays, 2 stops. u8.
inline constexpr Object kErrorBehaviour{0x1029, 1};
inline constexpr Object kProducerHeartbeat{0x1017, 0};  ///< u16, ms; 0 = off
inline constexpr Object kVendorId{0x1018, 1}, kProductCode{0x1018, 2};
inline constexpr Object kSerialNumber{0x1018, 4};
inline constexpr Object kStoreParameters{0x1010, 1};         ///< u32: kSaveSignature
inline constexpr std::uint32_t kSaveSignature = 0x65766173;  ///< "save"
inline constexpr Object kRpdo1CobId{0x1400, 1}, kRpdo1Type{0x1400, 2};
inline constexpr Object kRpdo1Timer{0x1400, 5};     ///< u16, ms: watchdog of the receiver; 0 = off
inline constexpr Object kRpdo1MapCount{0x1600, 0};  ///< u8; entries at subindex 1...
inline constexpr Object kTpdo1CobId{0x1800, 1}, kTpdo1Type{0x1800, 2};
inline constexpr Object kTpdo1Timer{0x1800, 5};  ///< u16, ms: repeat of an event-driven PDO; 0 = off
inline constexpr Object kTpdo1MapCount{0x1A00, 0};
inline constexpr std::uint16_t kMappingOffset = 0x200;     ///< Of a PDO's mapping from its parameters.
inline constexpr std::uint32_t kPdoDisabled = 0x80000000;  ///< Bit 31 of a PDO's COB-ID.
inline constexpr std::uint32_t kMostMapped =
    64;  ///< Entries of a mapping; 254 and 255 say that it is a multiplexed PDO.
inline constexpr std::uint8_t kEventDriven = 255;  ///< PDO type; 1...240 = every n-th SYNC.
// CiA 408 valves
inline constexpr Object kValveControlWord{0x6040, 0}, kValveStatusWord{0x6041, 0};
inline constexpr Object kValveControlMode{0x6042, 0};                        ///< i8; 1 = set-point from the bus
inline constexpr Object kValveSetPoint{0x6300, 1}, kValveActual{0x6301, 1};  ///< i16; 16384 = full stroke
// CiA 404 pressure; sub-index n is channel n
inline constexpr Object kPressureValue{0x9130, 1};   ///< i32, in 10^-digits of the unit
inline constexpr Object kPressureShort{0x7130, 1};   ///< i16, in 10^-digits of the unit
inline constexpr Object kPressureFloat{0x6130, 1};   ///< float32, in the unit
inline constexpr Object kPressureStatus{0x6150, 1};  ///< u8
inline constexpr Object kPressureUnit{0x6131, 1}, kPressureDigits{0x6132, 1};
inline constexpr std::uint32_t kUnitBar = 0x004E0000;
// CiA 406 encoders
inline constexpr Object kEncoderPosition{0x6004, 0};   ///< i32 steps
inline constexpr Object kEncoderPreset{0x6003, 0};     ///< i32 steps: what the position is to be here and now
inline constexpr Object kEncoderSpeed{0x6030, 1};      ///< i16 steps
inline constexpr Object kEncoderStep{0x6005, 1};       ///< u32, 0.001 um
inline constexpr Object kEncoderSpeedStep{0x6005, 2};  ///< u32, 0.01 mm/s
// A rotary one has u32 steps of a turn, and:
inline constexpr Object kEncoderStepsPerTurn{0x6001, 0}, kEncoderRange{0x6002, 0};  ///< u32; of all turns
// CiA 410 tilt
inline constexpr Object kTiltResolution{0x6000, 0};  ///< u16, 0.001 deg
inline constexpr Object kTiltSlope{0x6010, 0};       ///< i16 longitudinal slope
inline constexpr Object kTiltLateral{0x6020, 0};     ///< i16 lateral slope
// CiA 401 machine enable
inline constexpr Object kEnableInputs{0x6000, 1}, kEnableOutputs{0x6200, 1};  ///< u8
// CiA 401 analogue inputs and outputs; sub-index n is channel n, 0 how many there are
inline constexpr Object kAnalogInput{0x6401, 1}, kAnalogOutput{0x6411, 1};  ///< i16
inline constexpr Object kAnalogInputSends{0x6423, 0};                       ///< u8; 1: inputs are sent at all
inline constexpr Object kOutputErrorMode{0x6443, 1};                        ///< u8; 1: takes the error value, 0: stays
inline constexpr Object kOutputErrorValue{0x6444, 1};  ///< i32; where in it the 16 bits are, differs

/// One entry of a PDO mapping (objects 0x16nn, 0x1Ann).
[[nodiscard]] constexpr std::uint32_t mapping(Object object, unsigned bits) noexcept {
  return std::uint32_t{object.index} << 16 | std::uint32_t{object.subindex} << 8 | bits;
}
struct PdoMap {
  std::uint8_t count = 0;
  std::array<std::uint32_t, 8> entries{};
};
[[nodiscard]] constexpr std::uint32_t mapped_bits(std::uint32_t entry) noexcept {
  return entry & 0xFFU;
}
/// Of the mapped objects together: the length of a frame that carries them.
[[nodiscard]] constexpr std::uint8_t bytes_of(const PdoMap& map) noexcept {
  std::uint32_t bits = 0;
  for (std::uint8_t i = 0; i < map.count; ++i) bits += mapped_bits(map.entries[i]);
  return static_cast<std::uint8_t>(bits / 8);
}
inline constexpr PdoMap kValveTpdo{2, {mapping(kValveStatusWord, 16), mapping(kValveActual, 16)}};
inline constexpr PdoMap kValveRpdo{2, {mapping(kValveControlWord, 16), mapping(kValveSetPoint, 16)}};
inline constexpr PdoMap kPressureTpdo{2, {mapping(kPressureValue, 32), mapping(kPressureStatus, 8)}};
inline constexpr PdoMap kEncoderTpdo{2, {mapping(kEncoderPosition, 32), mapping(kEncoderSpeed, 16)}};
inline constexpr PdoMap kRotaryTpdo{1, {mapping(kEncoderPosition, 32)}};
inline constexpr PdoMap kTiltTpdo{1, {mapping(kTiltSlope, 16)}};
inline constexpr PdoMap kEnableTpdo{1, {mapping(kEnableInputs, 8)}};
inline constexpr PdoMap kEnableRpdo{1, {mapping(kEnableOutputs, 8)}};

// ---- NMT, SYNC, heartbeat
// --------------------------------------------------------------------------------------------
enum class NmtCommand : std::uint8_t {
  kStart = 0x01,
  kStop = 0x02,
  kEnterPreOperational = 0x80,
  kResetNode = 0x81,
  kResetCommunication = 0x82,
};
enum class NmtState : std::uint8_t { kBootUp = 0x00, kStopped = 0x04, kOperational = 0x05, kPreOperational = 0x7F };
struct NmtRequest {
  NmtCommand command = NmtCommand::kStop;
  std::uint8_t node = 0;  ///< 0 = all
};
[[nodiscard]] CanFrame nmt_frame(NmtCommand command, std::uint8_t node) noexcept;
[[nodiscard]] std::optional<NmtRequest> parse_nmt(const CanFrame& frame) noexcept;
[[nodiscard]] CanFrame sync_frame() noexcept;
[[nodiscard]] CanFrame heartbeat_frame(std::uint8_t node, NmtState state) noexcept;
/// The sender is node_of(frame.id).
[[nodiscard]] std::optional<NmtState> parse_heartbeat(const CanFrame& frame) noexcept;

// ---- EMCY
// ------------------------------------------------------------------------------------------------------------
inline constexpr std::uint16_t kEmcyReset = 0x0000, kEmcyGeneric = 0x1000, kEmcyHeartbeat = 0x8130,
                               kEmcyRpdoTimeout = 0x8250, kEmcyExternal = 0x9000, kEmcySensor = 0x5030,
                               kEmcyDeviceSpecific = 0xFF00;
struct Emergency {
  std::uint16_t code = 0;
  std::uint8_t error_register = 0;
  std::array<std::uint8_t, 5> vendor{};
};
[[nodiscard]] CanFrame emergency_frame(std::uint8_t node, const Emergency& emergency) noexcept;
[[nodiscard]] std::optional<Emergency> parse_emergency(const CanFrame& frame) noexcept;
/// What an EMCY error code says, such as "heartbeat of a watched node missing"; its class where the code is unknown.
[[nodiscard]] const char* emergency_text(std::uint16_t code) noexcept;

// ---- Expedited SDO
// ---------------------------------------------------------------------------------------------------
enum class SdoAbort : std::uint32_t {
  kNone = 0,
  kToggle = 0x05030000,
  kTimeout = 0x05040000,
  kUnknownCommand = 0x05040001,
  kUnsupportedAccess = 0x06010000,
  kWriteOnly = 0x06010001,
  kReadOnly = 0x06010002,
  kNoObject = 0x06020000,
  kNotMappable = 0x06040041,
  kPdoTooLong = 0x06040042,
  kTooLong = 0x06070012,
  kTooShort = 0x06070013,
  kNoSubindex = 0x06090011,
  kInvalidValue = 0x06090030,
  kCannotStore = 0x08000020,
  kLocalControl = 0x08000021,
  kDeviceState = 0x08000022,
};
[[nodiscard]] const char* abort_text(SdoAbort code) noexcept;

/// Client to server: write `size` (1, 2 or 4) bytes of value.
[[nodiscard]] CanFrame sdo_download(std::uint8_t node, Object object, std::uint32_t value, std::uint8_t size) noexcept;
/// Client to server: read.
[[nodiscard]] CanFrame sdo_upload(std::uint8_t node, Object object) noexcept;
/// Client to server: an answer is not waited for any more.
[[nodiscard]] CanFrame sdo_abandoned(std::uint8_t node, Object object, SdoAbort code) noexcept;

/// What a server answered. The sender is node_of(frame.id).
struct SdoResponse {
  enum class Kind : std::uint8_t { kDownloaded, kUploaded, kAborted, kNotExpedited } kind = Kind::kAborted;
  Object object;
  std::uint32_t value = 0;  ///< kUploaded
  std::uint8_t size = 0;    ///< kUploaded: bytes, 4 where the server gave no size
  SdoAbort abort = SdoAbort::kNone;
};
/// nullopt where it is no SDO response at all.
[[nodiscard]] std::optional<SdoResponse> parse_sdo_response(const CanFrame& frame) noexcept;

// The server's side.
struct SdoRequest {
  enum class Kind : std::uint8_t { kDownload, kUpload, kAbort, kOther } kind = Kind::kOther;
  Object object;
  std::uint32_t value = 0;
  std::uint8_t size = 0;  ///< 0: a download that does not say
};
[[nodiscard]] std::optional<SdoRequest> parse_sdo_request(const CanFrame& frame) noexcept;
[[nodiscard]] CanFrame sdo_downloaded(std::uint8_t node, Object object) noexcept;
[[nodiscard]] CanFrame sdo_uploaded(std::uint8_t node, Object object, std::uint32_t value, std::uint8_t size) noexcept;
[[nodiscard]] CanFrame sdo_aborted(std::uint8_t node, Object object, SdoAbort code) noexcept;

// ---- CiA 408 state machine
// -------------------------------------------------------------------------------------------
inline constexpr std::uint16_t kControlInit = 0x0, kControlDisabled = 0x1, kControlHold = 0x3, kControlActive = 0x7;
inline constexpr std::uint16_t kControlReset = 0x8;  ///< Rising edge, bit 2 clear.
inline constexpr std::uint16_t kStatusReady = 0x8;   ///< 0: fault
inline constexpr std::uint16_t kStatusLocal = 0x10;  ///< Set-point is not taken from the bus.
enum class ValveState : std::uint8_t { kInit = 0x0, kDisabled = 0x1, kHold = 0x3, kActive = 0x7 };
/// nullopt where bits 0..2 are none of the four states. Whether it is a fault: (status & kStatusReady) == 0.
[[nodiscard]] std::optional<ValveState> valve_state(std::uint16_t status_word) noexcept;
[[nodiscard]] constexpr bool valve_fault(std::uint16_t status_word) noexcept {
  return (status_word & kStatusReady) == 0;
}

// ---- PDOs of the default map. Of a frame longer than mapped the first bytes count (CiA 301); nullopt for a shorter
// one.
// -----------------------------------------------
inline constexpr double kFullStroke = 16384;    ///< Set-point and actual value at 100 % of spool stroke.
inline constexpr double kEncoderStep_m = 1e-4;  ///< 0x6005:01 = 100000, where nothing else is said.
inline constexpr double kTiltStep_rad = 0.1 * std::numbers::pi / 180;  ///< 0x6000 = 100, where nothing else is said.
/// Objects 0x6005:01 (0.001 um) and 0x6000 (0.001 deg) of these steps, to the nearest.
[[nodiscard]] std::uint32_t encoder_step_object(double step_m) noexcept;
[[nodiscard]] std::uint32_t tilt_step_object(double step_rad) noexcept;

/// Nearest step count, saturated to the range of T; 0 for NaN (the neutral of a set-point).
template <typename T>
[[nodiscard]] T to_steps(double value, double step) noexcept;
extern template std::int16_t to_steps<std::int16_t>(double, double) noexcept;
extern template std::int32_t to_steps<std::int32_t>(double, double) noexcept;

struct ValveStatus {
  std::uint16_t status_word = 0;
  double spool = 0;  ///< Actual position, fraction of stroke, positive = extend.
};
struct ValveCommand {
  std::uint16_t control_word = 0;
  double set_point = 0;  ///< Fraction of spool stroke, positive = extend.
};
[[nodiscard]] CanFrame valve_status_frame(std::uint32_t cob_id, const ValveStatus& status,
                                          double full_stroke = kFullStroke) noexcept;
[[nodiscard]] std::optional<ValveStatus> parse_valve_status(const CanFrame& frame,
                                                            double full_stroke = kFullStroke) noexcept;
[[nodiscard]] CanFrame valve_command_frame(std::uint32_t cob_id, const ValveCommand& command,
                                           double full_stroke = kFullStroke) noexcept;
[[nodiscard]] std::optional<ValveCommand> parse_valve_command(const CanFrame& frame,
                                                              double full_stroke = kFullStroke) noexcept;

inline constexpr std::uint8_t kPressureInvalid = 1, kPressureOverload = 2, kPressureUnderload = 4;  ///< 0x6150 bits

/// Bits of the enable node's inputs and of its output.
inline constexpr std::uint8_t kInputEStopClosed = 1;  ///< The machine's E-stop chain is closed: nobody has pressed.
inline constexpr std::uint8_t kInputPilotOn = 2;      ///< Pilot pressure is on: valves can move.
inline constexpr std::uint8_t kOutputEnable = 1;      ///< Asks for pilot pressure.
[[nodiscard]] CanFrame enable_inputs_frame(std::uint32_t cob_id, std::uint8_t inputs) noexcept;
[[nodiscard]] CanFrame enable_output_frame(std::uint32_t cob_id, std::uint8_t outputs) noexcept;
/// Either of the two: its first byte.
[[nodiscard]] std::optional<std::uint8_t> parse_enable(const CanFrame& frame) noexcept;

}  // namespace knuckle::canopen
