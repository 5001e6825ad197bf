// A signal that a test raises is not there for the next test of its process.
#pragma once

#include "app/cli/interrupt.h"

namespace knuckle::test {

/// At its end, so declared before any guard.
struct ForgetInterrupts {
  ForgetInterrupts() = default;
  ForgetInterrupts(const ForgetInterrupts&) = delete;
  ForgetInterrupts& operator=(const ForgetInterrupts&) = delete;
  ~ForgetInterrupts() { const cli::InterruptGuard none_has_come; }
};

}  // namespace knuckle::test
