// What bad input is refused with.
#pragma once

#include <string>

#include "core/error.h"

namespace knuckle::test {

/// The message of the InputError that `act` throws; "accepted" where it throws none.
template <typename Act>
std::string refusal(const Act& act) {
  try {
    (void)act();
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace knuckle::test
