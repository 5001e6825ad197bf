// What happened in a session, in words, as Foxglove's log messages.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/time.h"

namespace knuckle::recording {

/// As in foxglove_msgs/Log.
enum class Severity : std::uint8_t { kUnknown, kDebug, kInfo, kWarning, kError, kFatal };

struct Event {
  Time at{};
  Severity severity = Severity::kInfo;
  std::string kind;  ///< "fault", "mode", "bookmark", "recorder"
  std::string text;
};

/// foxglove_msgs/Log. @param unix_ns of session time 0.
[[nodiscard]] std::vector<std::uint8_t> encode_log(const Event& event, std::int64_t unix_ns);
/// nullopt where the message is none of these.
[[nodiscard]] std::optional<Event> decode_log(std::span<const std::uint8_t> message, std::int64_t unix_ns);

// A picture of a camera as the operator saw it, as JPEG: Foxglove's CompressedImage. Only where they were asked for.

struct CameraPicture {
  Time at{};           ///< Session time when the console took it to show it, as its CameraStamp has it.
  std::string camera;  ///< Its name.
  std::vector<std::uint8_t> jpeg;
};

/// foxglove_msgs/CompressedImage; the camera's name is its frame. @param unix_ns of session time 0.
[[nodiscard]] std::vector<std::uint8_t> encode_camera_picture(const CameraPicture& picture, std::int64_t unix_ns);
/// @return nothing for what is no such message.
[[nodiscard]] std::optional<CameraPicture> decode_camera_picture(std::span<const std::uint8_t> message,
                                                                 std::int64_t unix_ns);

// When a camera's picture was captured, came in and was shown: one message a picture, without the picture. Session
// times in it are those of the newest step that the console has seen: up to 5 ms early, and they stand still while a
// session is paused.

inline constexpr const char* kCameraStampSchemaName = "knuckle_msgs/msg/CameraStamp";

struct CameraStamp {
  Time at{};                 ///< Session time when the console took it to show it.
  std::string camera;        ///< Its name.
  std::uint64_t number = 0;  ///< Counts the camera's pictures up from 1; those that were replaced by newer ones, too.
  std::uint32_t connection = 0;  ///< Of the camera to its source; counts up from 1.
  bool senders_clock = false;    ///< Of `captured`: it is the sender's, of which differences alone mean anything.
  Time captured{};               ///< Session time, or else the sender's stamp.
  Time received{};               ///< Session time, decoded and ready to be shown.
  double age_s = 0;              ///< As shown beside it: since capture; by a sender's clock over the quickest picture.
};

[[nodiscard]] std::string camera_stamp_schema();
[[nodiscard]] std::vector<std::uint8_t> encode_camera_stamp(const CameraStamp& stamp);

}  // namespace knuckle::recording
