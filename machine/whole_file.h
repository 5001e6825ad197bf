// Files that are read whole before anything in them is looked at.
#pragma once

#include <cstddef>
#include <string>

namespace knuckle {

/// The bytes of a regular file.
/// @throws InputError with file and reason where it cannot be read or is larger than most_MB [10^6 bytes]; no more than
/// that is ever read, so that no file can take a computer's memory.
[[nodiscard]] std::string whole_file(const std::string& path, std::size_t most_MB);

}  // namespace knuckle
