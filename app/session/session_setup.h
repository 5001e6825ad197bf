// From options to a session that can run: files read, machine and limb sampled, everything checked.
#pragma once

#include <string>
#include <vector>

#include "app/session/options.h"
#include "app/session/session.h"

namespace knuckle::session {

struct LoadedSession {
  SessionSetup setup;
  std::string operator_name;       ///< Limb, or the recorded motion.
  std::vector<std::string> notes;  ///< What was done to the inputs.
  bool shortened = false;          ///< --duration ends it before the scenario would give it up.
};

/// @param follows_plan false: the hand is moved otherwise, and the inputs of the scenario's plan are not required.
/// @throws InputError for bad scenario, machine, device, map or motion files, or files that do not fit together.
[[nodiscard]] LoadedSession load_session(const SimulateOptions& options, bool follows_plan = true);

}  // namespace knuckle::session
