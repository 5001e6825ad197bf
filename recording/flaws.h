// What a recording lacks of the session that it is of.
#pragma once

#include <string>
#include <vector>

#include "recording/recording.h"

namespace knuckle::recording {

/// A line for each place that cannot be read, and one where it has no end; complete once next() has come to its end.
/// Empty: it is whole.
[[nodiscard]] std::vector<std::string> flaws(const Recording& recording);
/// All that a reader should be told of the files: flaws, and what is unusual in their order.
[[nodiscard]] std::vector<std::string> remarks(const Recording& recording);

}  // namespace knuckle::recording
