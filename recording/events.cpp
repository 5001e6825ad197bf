#include "recording/events.h"

#include "recording/cdr.h"

namespace knuckle::recording {

std::vector<std::uint8_t> encode_log(const Event& event, std::int64_t unix_ns) {
  std::vector<std::uint8_t> room(64 + event.text.size() + event.kind.size());
  CdrWriter out(room);
  out.put_time(unix_ns + event.at.time_since_epoch().count());
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
  event.at = Time(Duration(in.get_time() - unix_ns));
  event.severity = static_cast<Severity>(in.get<std::uint8_t>());
  event.text = in.get_text();
  event.kind = in.get_text();
  if (!in.ok() || event.severity > Severity::kFatal) return std::nullopt;
  return event;
}

}  // namespace knuckle::recording
