// Numbers in text, as printf writes them.
#pragma once

#include <string>

namespace knuckle {

/// printf's result, whole whatever its length.
[[nodiscard, gnu::format(printf, 1, 2)]] std::string formatted(const char* format, ...);

}  // namespace knuckle
