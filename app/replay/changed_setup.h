// A recorded session's loops with something else in its place: what --with and --control ask for.
#pragma once

#include <string>
#include <vector>

#include "recording/replay.h"

namespace knuckle::replay {

struct Changes {
  std::vector<std::string> with;  ///< Machines or devices, names or files; a file says which it is by its keys.
  std::string control;            ///< Bilateral law; empty: the recorded one.
  [[nodiscard]] bool any() const noexcept { return !with.empty() || !control.empty(); }
};

/// @throws InputError naming the option.
void change(recording::ReplaySetup& setup, const Changes& changes);

}  // namespace knuckle::replay
