#include "app/cli/interrupt.h"

#include <csignal>

namespace knuckle::cli {
namespace {

volatile std::sig_atomic_t signalled = 0;  // a handler can reach nothing else

void note_signal(int) {
  signalled = 1;
}

}  // namespace

InterruptGuard::InterruptGuard() noexcept {
  signalled = 0;
  previous_interrupt_ = std::signal(SIGINT, note_signal);
  previous_terminate_ = std::signal(SIGTERM, note_signal);
  previous_hang_up_ = std::signal(SIGHUP, note_signal);
  previous_pipe_ = std::signal(SIGPIPE, SIG_IGN);  // a reader that left shows as a failed write, which is reported
}

InterruptGuard::~InterruptGuard() {
  std::signal(SIGINT, previous_interrupt_);
  std::signal(SIGTERM, previous_terminate_);
  std::signal(SIGHUP, previous_hang_up_);
  std::signal(SIGPIPE, previous_pipe_);
}

bool InterruptGuard::pending() const noexcept {
  return signalled != 0;
}

void InterruptGuard::check() const {
  if (pending()) throw Interrupted();
}

}  // namespace knuckle::cli
