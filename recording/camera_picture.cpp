#include "recording/camera_picture.h"

#include "recording/cdr.h"

namespace knuckle::recording {

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

}  // namespace knuckle::recording
