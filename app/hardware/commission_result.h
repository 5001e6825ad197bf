// The result of a commissioning as a TOML file (docs/commissioning.md says what its keys mean).
#pragma once

#include <ostream>
#include <string>

#include "app/hardware/commission_wizard.h"
#include "machine/description.h"

namespace knuckle::app {

/// Where and when it was made.
struct ResultOrigin {
  std::string bus, date, machine_sha256;
};
void write_wizard_result(const WizardResult& result, const MachineDescription& machine, const ResultOrigin& origin,
                         std::ostream& out);

}  // namespace knuckle::app
