// What a call says of the input that it refuses.
#pragma once

#include <string>

#include "core/error.h"

namespace knuckle::test {

/// "accepted" where `call` takes its input.
template <class Call>
[[nodiscard]] std::string refusal(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace knuckle::test
