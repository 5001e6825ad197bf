// Files and folders that nobody but their owner may change.
#pragma once

#include <string>

namespace knuckle::cli {

/// @param what "file" or "folder". @param danger what anybody else could do, for the message: "change the audit trail".
/// @throws InputError where it belongs to another user (but root), or anybody else may write it.
void check_only_owner_writes(const std::string& path, const char* what, const char* danger);

}  // namespace knuckle::cli
