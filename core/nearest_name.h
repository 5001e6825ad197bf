// Which known name a misspelt one was meant to be.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace knuckle {

/// The nearest of `names`, at most `furthest` edits (insert, delete, replace, swap neighbours) from `name`.
[[nodiscard]] std::optional<std::string> nearest_name(std::string_view name, std::span<const std::string> names,
                                                      std::size_t furthest);
/// At most as far as a misspelt name is: two edits, or two in five of its characters.
[[nodiscard]] std::optional<std::string> nearest_name(std::string_view name, std::span<const std::string> names);

}  // namespace knuckle
