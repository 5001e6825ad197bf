// Lines of a person's TOML file, changed one by one: comments and order stay as they are.
#pragma once

#include <string>

namespace knuckle {

/// The key that a line of TOML sets, or its [table] in brackets; empty where it does neither.
[[nodiscard]] std::string toml_key(const std::string& line);

/// "key = value", with the comment that stands behind the old value.
[[nodiscard]] std::string with_toml_value(const std::string& line, const std::string& value);

}  // namespace knuckle
