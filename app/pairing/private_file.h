// Files that only their owner may read or write, and that are never there in part.
#pragma once

#include <cstdint>
#include <string>

namespace knuckle::pairing {

enum class Existing : std::uint8_t { kRefuse, kReplace };

/// Behind the name of a file that is being written, and that is left where its program was killed meanwhile.
inline constexpr const char* kLeftOver = ".part-";

/// Whole or not at all, mode 0600, on the disk when it returns. @throws InputError
void write_private_file(const std::string& file, const std::string& text, Existing existing);
/// Of a file that decides who controls the machine, or of the folder of one. @param what "file" or "folder".
/// @throws InputError where it belongs to another user, or anybody else may write it.
void check_only_owner_writes(const std::string& path, const char* what);

}  // namespace knuckle::pairing
