// Text of others (files, command lines, devices) inside Knuckle's own messages: one line, printable, of bounded length.
// And times as text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace knuckle {

/// Every control character (line ends, escape sequences, those that turn the direction of writing) and every byte that
/// is not UTF-8 as \xNN, all else as it is. What is printable already is returned unchanged.
[[nodiscard]] std::string printable(std::string_view text);

/// Text of several lines: the same, but that line ends and tabs stay.
[[nodiscard]] std::string printable_lines(std::string_view text);

/// A key, value or name in a message: printable, and beyond `longest` characters its beginning and its length:
/// "aaaa... (10000000 characters)".
[[nodiscard]] std::string shortened(std::string_view text, std::size_t longest = 60);

/// A whole message as it goes to a terminal: printable, and too long a one without its middle, as file and key stand in
/// front and the bound last.
[[nodiscard]] std::string one_message(std::string_view text);

/// A time in UTC, as ISO 8601 or as strftime(3) has it.
[[nodiscard]] std::string utc_text(std::int64_t unix_s, const char* format = "%Y-%m-%dT%H:%M:%SZ");

}  // namespace knuckle
