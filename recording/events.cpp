#include "recording/events.h"

#include "recording/cdr.h"

namespace knuckle::recording {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

std::string log_schema() {
  return "builtin_interfaces/Time timestamp\n"
         "uint8 UNKNOWN=0\nuint8 DEBUG=1\nuint8 INFO=2\nuint8 WARNING=3\nuint8 ERROR=4\nuint8 FATAL=5\n"
         "uint8 level\n"
         "string message\n"
         "string name\n"
         "string file\n"
         "uint32 line\n" +
         std::string(80, '=') + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
}

std::vector<std::uint8_t> encode_log(const Event& event, std::int64_t unix_ns) {
  const std::int64_t at_ns = unix_ns + event.at.time_since_epoch().count();
  std::vector<std::uint8_t> room(64 + event.text.size() + event.kind.size());
  CdrWriter out(room);
  out.put(static_cast<std::int32_t>(at_ns / kSecond_ns));
  out.put(static_cast<std::uint32_t>(at_ns % kSecond_ns));
  out.put(static_cast<std::uint8_t>(event.severity));
  out.put_text(event.text);
  out.put_text(event.kind);
  out.put_text("");
  out.put(std::uint32_t{0});
  room.resize(out.size());
  return room;
}

std::optional<Event> decode_log(std::span<const std::uint8_t> message, std::int64_t unix_ns) {
  CdrReader in(message);
  Event event;
  const std::int64_t seconds = in.get<std::int32_t>();
  const std::int64_t at_ns = seconds * kSecond_ns + in.get<std::uint32_t>();
  event.at = Time(Duration(at_ns - unix_ns));
  event.severity = static_cast<Severity>(in.get<std::uint8_t>());
  event.text = in.get_text();
  event.kind = in.get_text();
  if (!in.ok() || event.severity > Severity::kFatal) return std::nullopt;
  return event;
}

}  // namespace knuckle::recording
