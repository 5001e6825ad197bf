// A session of a battery again, from the battery's result.
#pragma once

#include <string>

#include "app/session/options.h"

namespace knuckle::battery {

/// @param name FILE:N: session N of the battery whose result `knuckle-studies sweep --json` wrote into FILE; as
/// --from-cell takes it. @return its inputs, and the digest that it had. @throws InputError
[[nodiscard]] session::SimulateOptions cell_of_result(const std::string& name);

}  // namespace knuckle::battery
