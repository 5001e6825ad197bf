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

std::vector<std::uint8_t> encode_camera_picture(const CameraPicture& picture, std::int64_t unix_ns) {
  std::vector<std::uint8_t> room(64 + picture.camera.size() + picture.jpeg.size());
  CdrWriter out(room);
  out.put_time(unix_ns + picture.at.time_since_epoch().count());
  out.put_text(picture.camera);
  out.put_bytes(picture.jpeg);
  out.put_text("jpeg");
  room.resize(out.size());
  return room;
}

std::optional<CameraPicture> decode_camera_picture(std::span<const std::uint8_t> message, std::int64_t unix_ns) {
  CdrReader in(message);
  CameraPicture picture;
  picture.at = Time(Duration(in.get_time() - unix_ns));
  picture.camera = in.get_text();
  const std::span<const std::uint8_t> jpeg = in.get_bytes();
  picture.jpeg.assign(jpeg.begin(), jpeg.end());
  if (in.get_text() != "jpeg" || !in.ok()) return std::nullopt;
  return picture;
}

namespace {

std::int64_t ns_of(Time at) {
  return at.time_since_epoch().count();
}

}  // namespace

std::string camera_stamp_schema() {
  return "# A picture of a camera, without the picture. The session clock is that of the newest step that\n"
         "# the console has seen: up to 5 ms early, and it stands still while a session is paused.\n"
         "int64 time_ns        # session clock, when it was taken to be shown\n"
         "string camera\n"
         "uint64 number        # counts the camera's pictures from 1\n"
         "uint32 connection    # of the camera to its source, counts from 1\n"
         "bool senders_clock   # captured_ns is the sender's stamp: differences alone mean anything\n"
         "int64 captured_ns    # session clock, else the sender's\n"
         "int64 received_ns    # session clock\n"
         "float64 age_s        # since capture; by a sender's clock over the quickest picture's\n";
}

std::vector<std::uint8_t> encode_camera_stamp(const CameraStamp& stamp) {
  std::vector<std::uint8_t> room(96 + stamp.camera.size());
  CdrWriter out(room);
  out.put(ns_of(stamp.at));
  out.put_text(stamp.camera);
  out.put(stamp.number);
  out.put(stamp.connection);
  out.put(static_cast<std::uint8_t>(stamp.senders_clock));
  out.put(ns_of(stamp.captured));
  out.put(ns_of(stamp.received));
  out.put(stamp.age_s);
  room.resize(out.size());
  return room;
}

}  // namespace knuckle::recording
