// `knuckle replay`: runs the loops of a recording again and says where they do otherwise; with --with, --control and
// --contact-model, with something else in their place.
#pragma once

#include <string>
#include <vector>

#include "app/cli/command.h"
#include "recording/replay.h"

namespace knuckle::replay {

struct Changes {
  std::vector<std::string> with;  ///< Machines or devices, names or files; a file says which it is by its keys.
  std::string control;            ///< Bilateral law; empty: the recorded one.
  std::string contact_model;      ///< Likewise.
  [[nodiscard]] bool any() const noexcept { return !with.empty() || !control.empty() || !contact_model.empty(); }
};

/// @throws InputError naming the option.
void change(recording::ReplaySetup& setup, const Changes& changes);

[[nodiscard]] cli::Command replay_entry();

}  // namespace knuckle::replay
