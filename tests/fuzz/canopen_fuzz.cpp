// Any CAN frame, sizes beyond 8 included: refused, or values that are finite and inside their physical range.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "tests/fuzz/require.h"
#include "transport/canopen.h"
#include "transport/j1939_packets.h"
#include "transport/lss.h"
#include "transport/signal_codec.h"

namespace {

using knuckle::test::require;

void check(const knuckle::CanFrame& frame) {
  namespace canopen = knuckle::canopen;
  if (const auto status = canopen::parse_valve_status(frame)) require(std::abs(status->spool) <= 2);
  if (const auto command = canopen::parse_valve_command(frame)) require(std::abs(command->set_point) <= 2);
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
  for (const auto& message : {knuckle::lss::parse_request(frame), knuckle::lss::parse_answer(frame)}) {
    if (!message) continue;
    const knuckle::CanFrame again = knuckle::lss::request(message->service, message->value);
    require(frame.size == 8 && std::equal(again.data.begin(), again.data.begin() + 5, frame.data.begin()));
    require(knuckle::lss::error_text(message->service, message->code()) != nullptr);
  }
}

/// Wherever a field lies: it is read, or the frame is too short for it.
void check(const knuckle::BitField& field, const knuckle::CanFrame& frame) {
  const auto value = knuckle::read_value(field, frame);
  const bool fits = frame.size <= 8 && field.start_bit + field.bits <= 8 * frame.size;
  if (field.type != knuckle::BitField::Type::kFloat && field.order == knuckle::BitField::Order::kLittleEndian && fits)
    require(value && std::isfinite(*value));
}

/// As announcements and packets of one sender, 9 bytes each: a message is one of its announced length, or none.
void check_packets(const std::uint8_t* data, std::size_t size) {
  namespace j1939 = knuckle::j1939;
  j1939::PacketReader reader;
  knuckle::Time now{std::chrono::seconds(1)};
  for (; size >= 9; data += 9, size -= 9) {
    knuckle::CanFrame frame;
    frame.id = j1939::identifier(data[0] % 2 == 0 ? j1939::kConnection : j1939::kTransfer, 0x21);
    frame.size = static_cast<std::uint8_t>(data[0] < 250 ? 8 : data[0]);
    std::copy_n(data + 1, frame.data.size(), frame.data.begin());
    now += std::chrono::milliseconds(4 * data[0]);
    if (const auto said = j1939::announced(frame)) reader.begin(*said, now);
    if (const auto number = j1939::packet_number(frame)) {
      const auto lost = reader.add(*number, frame, now);
      require(!lost || (lost->packet >= 1 && lost->packet <= lost->of));
    }
    const std::size_t bytes = reader.message().size();
    require(bytes == 0 || (!reader.under_way() && bytes >= j1939::kLeastMessage && bytes <= j1939::kMostMessage));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3) return 0;
  check_packets(data, size);
  knuckle::CanFrame frame;
  frame.id = static_cast<std::uint32_t>(data[0] | data[1] << 8) & 0x7FFU;
  frame.size = data[2];
  std::copy_n(data + 3, std::min(size - 3, frame.data.size()), frame.data.begin());
  check(frame);
  knuckle::BitField field;
  field.type = static_cast<knuckle::BitField::Type>(data[0] % 3);
  field.order = static_cast<knuckle::BitField::Order>(data[0] / 3 % 2);
  field.start_bit = data[1];
  field.bits = field.type == knuckle::BitField::Type::kFloat ? 32 : static_cast<std::uint8_t>(1 + data[2] % 64);
  check(field, frame);
  return 0;
}
