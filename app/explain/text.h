// Names and numbers as a person reads them.
#pragma once

#include <string>

#include "core/reason.h"
#include "core/time.h"
#include "machine/description.h"

namespace knuckle::explain {

/// "12.340 s"
[[nodiscard]] std::string at_text(Time at);
/// "35 ms"; from 10 s on "12.3 s".
[[nodiscard]] std::string span_text(Duration span);
/// The one line of a reason, and of an EMCY code its meaning.
[[nodiscard]] std::string reason_text(const MachineDescription& machine, const Reason& reason);

}  // namespace knuckle::explain
