#include "machine/load_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/units.h"
#include "machine/reason_text.h"
#include "transport/canopen.h"
#include "transport/j1939.h"

namespace knuckle {
namespace {

constexpr double kSlowestMessage_ms = 10000;  // of several packets

/// bits, type and order.
BitField read_meaning_of_bits(TomlTable& file) {
  BitField bits;
  bits.bits = static_cast<std::uint8_t>(file.integer("bits", 1, 64));
  if (file.has("type")) bits.type = static_cast<BitField::Type>(file.choice("type", {"unsigned", "signed", "float"}));
  if (file.has("order")) bits.order = static_cast<BitField::Order>(file.choice("order", {"little", "big"}));
  file.require(bits.type != BitField::Type::kFloat || bits.bits == 32 || bits.bits == 64, "bits",
               "must be 32 or 64 of a float", {"type"});
  return bits;
}

FrameCounter read_counter(TomlTable file, std::uint8_t frame_bytes) {
  FrameCounter counter{.field = read_bits(file, frame_bytes), .modulus = 0};
  const std::int64_t most = most_raw(file, counter.field);
  if (file.has("modulus")) counter.modulus = static_cast<std::uint64_t>(file.integer("modulus", 2, most + 1));
  return counter;
}

/// Over all bytes of the frame but its own where the file does not say which.
FrameChecksum read_checksum(TomlTable file, std::uint8_t frame_bytes) {
  constexpr unsigned kByte = 8;
  FrameChecksum checksum;
  checksum.kind = static_cast<FrameChecksum::Kind>(file.choice("kind", kChecksumNames));
  checksum.field = read_bits(file, frame_bytes);
  file.require(checksum.field.bits <= kByte, "bits", "must be at most 8", {"type"});
  const bool is_crc =
      checksum.kind == FrameChecksum::Kind::kCrc8J1850 || checksum.kind == FrameChecksum::Kind::kCrc8H2f;
  file.require(!is_crc || checksum.field.bits >= kByte, "bits", "must be 8 of a CRC", {"kind"});
  const auto own = static_cast<std::uint8_t>(checksum.field.start_bit / kByte);
  std::vector<double> bytes;
  if (file.has("bytes")) {
    bytes = file.list("bytes", 1, 8, 0, frame_bytes - 1.0);
  } else {
    for (std::uint8_t byte = 0; byte < frame_bytes; ++byte)
      if (byte != own) bytes.push_back(byte);
  }
  for (const double byte : bytes) {
    file.require(byte == std::floor(byte), "bytes", "must be whole numbers");
    file.require(byte != own || checksum.field.bits < kByte, "bytes",
                 "have the checksum's own: it cannot cover itself");
    checksum.bytes[checksum.byte_count++] = static_cast<std::uint8_t>(byte);
  }
  if (file.has("data_id")) {
    for (const double byte : file.list("data_id", 1, 2, 0, 255)) {
      file.require(byte == std::floor(byte), "data_id", "must be whole numbers");
      checksum.data_id[checksum.data_id_count++] = static_cast<std::uint8_t>(byte);
    }
    if (file.has("data_id_first")) checksum.data_id_first = file.boolean("data_id_first");
  }
  return checksum;
}

/// Of 29 bits where it needs them or is said to have them.
std::uint32_t read_id(TomlTable& file) {
  const auto id = static_cast<std::uint32_t>(file.integer("id", 0, kMostExtendedId));
  bool extended = id > kMostId;
  if (file.has("extended")) {
    const bool said = file.boolean("extended");
    file.require(said || !extended, "extended", fmt::format("must be true: id is above 0x{:03X}", kMostId), {"id"});
    extended = extended || said;
  }
  return extended ? id | kExtendedId : id;
}

/// A J1939 parameter group, whichever priority it is sent with.
void read_group(TomlTable& file, BroadcastFrame& head) {
  const auto group = static_cast<std::uint32_t>(file.integer("pgn", 0, j1939::kMostGroup));
  file.require(!j1939::has_destination(group) || (group & 0xFFU) == 0, "pgn",
               "must end with 00: the last byte is the receiver's address in groups below 0xF000");
  if (file.has("source")) head.source = static_cast<std::uint8_t>(file.integer("source", 0, j1939::kMostAddress));
  head.id = j1939::identifier(group, head.source.value_or(j1939::kNoAddress));
  head.mask = j1939::group_mask(group);
  head.on_request = file.has("request_every_s");
}

/// Whether a frame could be either of the two.
bool may_be_both(const BroadcastFrame& a, const BroadcastFrame& b) {
  const auto mask = [](const BroadcastFrame& head) { return head.mask | (head.source ? 0xFFU : 0U); };
  return CanFilter(a.id, mask(a) & mask(b)).lets(b.id);
}

void check_name(const TomlTable& file, const std::string& name, const std::vector<BroadcastFrame>& others,
                const char* key) {
  constexpr std::size_t kLongest = 32;  // of a message in a DBC
  if (name.empty()) return;             // noted
  file.require(is_plain_name(name, kLongest), key, "must be a letter and up to 31 letters, digits and _");
  const auto same = [&](const BroadcastFrame& other) { return other.name == name; };
  file.require(std::none_of(others.begin(), others.end(), same), key, "is the name of another frame");
}

/// Frames under one identifier are told apart by what the same bits say.
void check_alone(const TomlTable& file, const BroadcastFrame& head, const std::vector<BroadcastFrame>& others,
                 const char* id_key) {
  for (const BroadcastFrame& other : others) {
    if (!may_be_both(other, head)) continue;
    if (!head.multiplexer || !other.multiplexer) {
      const bool one = head.multiplexer || other.multiplexer;
      file.require(false, id_key, "is taken by '" + other.name + "'" + (one ? ": both must have a multiplexer" : ""),
                   {"extended", "source", "multiplexer"});
      return;
    }
    const bool same = other.id == head.id && other.mask == head.mask && other.source == head.source;
    file.require(same, id_key, "may be that of '" + other.name + "': id or pgn, and source, must be as there");
    file.require(other.bytes == head.bytes, "bytes",
                 fmt::format("must be {}, as of '{}' under the same identifier", other.bytes, other.name));
    file.require(other.multiplexer->bits == head.multiplexer->bits, "multiplexer",
                 "must have the bits of that of '" + other.name + "'");
    file.require(other.multiplexer->value != head.multiplexer->value, "multiplexer",
                 fmt::format("has value {}, as that of '{}'", head.multiplexer->value, other.name));
  }
}

Multiplexer read_multiplexer(TomlTable file, std::uint8_t frame_bytes) {
  Multiplexer multiplexer{.bits = read_bits(file, frame_bytes)};
  const std::int64_t most = most_raw(file, multiplexer.bits);
  multiplexer.value = static_cast<std::uint64_t>(file.integer("value", 0, most));
  return multiplexer;
}

}  // namespace

bool is_plain_name(const std::string& name, std::size_t longest) {
  return !name.empty() && name.size() <= longest && std::isalpha(static_cast<unsigned char>(name.front())) != 0 &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

std::optional<int> channel_number(const std::string& key) {
  const bool digits = !key.empty() && key.size() <= 2 &&
                      std::all_of(key.begin(), key.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  if (!digits || key != std::to_string(std::stoi(key))) return std::nullopt;
  return std::stoi(key);
}

void check_frame_head(const TomlTable& file, const BroadcastFrame& head, const std::vector<BroadcastFrame>& others,
                      const char* name_key, const char* id_key) {
  check_alone(file, head, others, id_key);
  check_name(file, head.name, others, name_key);
}

BroadcastFrame read_frame_head(TomlTable& file, const std::vector<BroadcastFrame>& others, std::uint32_t bus,
                               bool is_broadcast, std::optional<std::uint8_t> own_address) {
  BroadcastFrame head;
  head.name = file.text("name");
  const bool group = is_broadcast && file.has("pgn");
  if (group)
    read_group(file, head);
  else
    head.id = read_id(file);
  if (own_address && (head.id & kExtendedId) != 0 && j1939::source_of(head.id) == *own_address)
    head.mask = j1939::kAllButPriorityAndSource;
  head.id |= bus;
  constexpr std::uint8_t kMostBytes = sizeof(CanFrame::data);
  head.bytes = static_cast<std::uint8_t>(file.integer("bytes", 1, is_broadcast ? j1939::kMostMessage : kMostBytes));
  const bool packets = j1939::in_packets(head.bytes);
  file.require(group || !packets, "bytes", "must be at most 8: only a group, by pgn, comes in several packets", {"id"});
  head.period_s = head.on_request ? file.number("request_every_s", 1, 3600)
                                  : file.number("period_ms", 1, packets ? kSlowestMessage_ms : 1000, kMilli);
  const double least_s = j1939::packets_of(head.bytes) * to_seconds(j1939::kPacketsApart);
  file.require(!packets || head.period_s >= least_s, head.on_request ? "request_every_s" : "period_ms",
               fmt::format("must be at least {}: {} packets come 50 ms apart",
                           number_text(head.on_request ? least_s : least_s / kMilli), j1939::packets_of(head.bytes)),
               {"bytes"});
  if (is_broadcast && !packets && file.has("multiplexer")) {
    file.require(!head.on_request, "multiplexer", "does not go with request_every_s", {"request_every_s"});
    head.multiplexer = read_multiplexer(file.table("multiplexer"), head.bytes);
  }
  check_frame_head(file, head, others, "name", group ? "pgn" : "id");
  return head;
}

std::vector<int> analog_numbers(TomlTable& file) {
  std::vector<int> numbers;
  for (const std::string& key : file.keys()) {
    if (const auto number = channel_number(key); number && *number >= 1 && *number <= kMostAnalogs) {
      numbers.push_back(*number);
      continue;
    }
    file.require(false, key, fmt::format("must be a channel from 1 to {}", kMostAnalogs));
    file.leave(key);
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

MessageBits read_message_bits(TomlTable& file, std::uint8_t message_bytes) {
  constexpr unsigned kByte = 8;
  const auto start = static_cast<unsigned>(file.integer("start", 0, kByte * message_bytes - 1));
  MessageBits message{.bits = read_meaning_of_bits(file), .first_byte = static_cast<std::uint8_t>(start / kByte)};
  message.bits.start_bit = start % kByte;
  file.require(message.bits.order == BitField::Order::kLittleEndian, "order",
               "must be little in a message of several packets");
  file.require(bytes_of(message.bits) <= sizeof(CanFrame::data), "bits", "must end within 8 bytes from the first one",
               {"start"});
  file.require(start + message.bits.bits <= kByte * message_bytes, "start",
               fmt::format("with {} bits it ends outside the message's {} bytes", message.bits.bits, message_bytes),
               {"bits"});
  return message;
}

BitField read_bits(TomlTable& file, std::uint8_t frame_bytes) {
  const auto start = static_cast<std::uint8_t>(file.integer("start", 0, 63));
  BitField bits = read_meaning_of_bits(file);
  bits.start_bit = start;
  file.require(bytes_of(bits) <= frame_bytes, "start",
               fmt::format("with {} bits it ends outside the frame's {} bytes", bits.bits, frame_bytes),
               {"bits", "order"});
  return bits;
}

std::int64_t most_raw(const TomlTable& file, const BitField& bits, std::uint8_t most_bits) {
  file.require(bits.type == BitField::Type::kUnsigned && bits.bits <= most_bits, "bits",
               fmt::format("must be at most {} of an unsigned", most_bits), {"type"});
  return (std::int64_t{1} << std::min(bits.bits, most_bits)) - 1;
}

FrameClosing read_frame_closing(TomlTable& file, std::uint8_t frame_bytes, const std::vector<UsedBits>& used) {
  FrameClosing closing;
  if (file.has("counter")) closing.counter = read_counter(file.table("counter"), frame_bytes);
  if (file.has("checksum")) closing.checksum = read_checksum(file.table("checksum"), frame_bytes);
  const auto apart = [&](const char* key, const BitField& bits, const BitField& other, const std::string& whose) {
    file.require(!overlap(bits, other), key, "has bits of " + whose);
  };
  for (const UsedBits& one : used) {
    if (closing.counter) apart("counter", closing.counter->field, one.bits, one.whose);
    if (closing.checksum) apart("checksum", closing.checksum->field, one.bits, one.whose);
  }
  if (closing.counter && closing.checksum)
    apart("checksum", closing.checksum->field, closing.counter->field, "the counter");
  return closing;
}

void check_frames_beside_nodes(const TomlTable& file, const BusDescription& bus) {
  const auto check = [&](const std::string& key, std::uint32_t id) {
    std::string whose;
    if (id == canopen::kNmtId) whose = "NMT";
    // Also where there is no node: who looks for devices asks under these.
    constexpr std::uint32_t kLastNode = 127, kLssAnswerId = 0x7E4, kLssRequestId = 0x7E5;  // CiA 305
    if (id >= canopen::sdo_request_id(0) && id <= canopen::sdo_request_id(kLastNode)) whose = "SDO requests";
    if (id == kLssAnswerId || id == kLssRequestId) whose = "LSS";
    const bool nodes = !bus.without_nodes();
    if (nodes && id == canopen::kSyncId) whose = "SYNC";
    if (nodes && id == canopen::heartbeat_id(bus.controller_id)) whose = "the controller's heartbeat";
    for (const NodeDescription& node : bus.nodes) {
      for (const std::uint32_t own : {canopen::emcy_id(node.id), canopen::sdo_response_id(node.id),
                                      canopen::sdo_request_id(node.id), canopen::heartbeat_id(node.id)})
        if (id == own) whose = "a service of '" + node.name + "'";
    }
    file.require(whose.empty(), key, "has " + id_text(id) + ", the identifier of " + whose);
  };
  for (std::size_t i = 0; i < bus.broadcasts.size(); ++i)
    check(fmt::format("broadcast[{}].id", i), bus.broadcasts[i].id);
  for (std::size_t i = 0; i < bus.commands.size(); ++i) check(fmt::format("command[{}].id", i), bus.commands[i].id);
}

}  // namespace knuckle
