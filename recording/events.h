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

}  // namespace knuckle::recording
