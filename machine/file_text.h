// A person's TOML file, changed line by line: comments and order stay as they are.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace knuckle {

/// The text with every line as `edit` leaves it; a line that it makes empty is taken out.
/// @param edit is given the [table] that the line stands in, with its brackets, empty before the first; the key that
/// the line sets, or the [table] that it opens, empty where it does neither; and the line, without its end.
[[nodiscard]] std::string edited_toml(
    std::string_view text,
    const std::function<void(const std::string& table, const std::string& key, std::string& line)>& edit);

/// The text without what a program has put at its end: the tables [name] and [name.*], and the comment that opens them.
/// Tables of others that stand behind them are kept. Ends with one end of line.
[[nodiscard]] std::string without_toml_record(std::string_view text, std::string_view name, std::string_view opening);

/// "key = value", with the comment that stands behind the old value.
[[nodiscard]] std::string with_toml_value(const std::string& line, const std::string& value);

/// A string in quotes; control characters, which may not stand there, become spaces.
[[nodiscard]] std::string toml_quoted(std::string_view text);

// Files that are read whole before anything in them is looked at.

/// The bytes of a regular file.
/// @throws InputError with file and reason where it cannot be read or is larger than most_MB [10^6 bytes]; no more than
/// that is ever read, so that no file can take a computer's memory.
[[nodiscard]] std::string whole_file(const std::string& path, std::size_t most_MB);

}  // namespace knuckle
