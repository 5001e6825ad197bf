// What stands at the beginning of a simulated session's recording.
#pragma once

#include <string>

#include "app/session/options.h"
#include "app/session/session.h"
#include "recording/head.h"

namespace knuckle::session {

/// Begun now. @param options that the set-up was made of.
[[nodiscard]] recording::Head session_head(const SessionSetup& setup, const SimulateOptions& options);

/// The text of a description's file; empty where it was not read from one.
[[nodiscard]] std::string file_text(const std::string& source);

}  // namespace knuckle::session
