#include "recording/camera_stamp.h"

#include "recording/cdr.h"

namespace knuckle::recording {
namespace {

std::int64_t ns_of(Time at) {
  return at.time_since_epoch().count();
}
Time get_time(CdrReader& in) {
  return Time(Duration(in.get<std::int64_t>()));
}

}  // namespace

std::string camera_stamp_schema() {
  return "# A picture of a camera, without the picture.\n"
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

std::optional<CameraStamp> decode_camera_stamp(std::span<const std::uint8_t> message) {
  CdrReader in(message);
  CameraStamp stamp;
  stamp.at = get_time(in);
  stamp.camera = in.get_text();
  in.get(stamp.number);
  in.get(stamp.connection);
  stamp.senders_clock = in.get<std::uint8_t>() != 0;
  stamp.captured = get_time(in);
  stamp.received = get_time(in);
  in.get(stamp.age_s);
  if (!in.ok() || in.at() != message.size()) return std::nullopt;
  return stamp;
}

}  // namespace knuckle::recording
