// Ctrl-C ends a session in order: through an exception, so that no half-written file stays behind.
#pragma once

#include <exception>

namespace knuckle::cli {

class Interrupted : public std::exception {
 public:
  [[nodiscard]] const char* what() const noexcept override { return "interrupted"; }
};

/// While one lives, SIGINT, SIGTERM and SIGHUP are noted instead of ending the program at once.
class InterruptGuard {
 public:
  InterruptGuard() noexcept;
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// A signal has come.
  [[nodiscard]] bool pending() const noexcept;
  /// @throws Interrupted once a signal has come.
  void check() const;

 private:
  void (*previous_interrupt_)(int);
  void (*previous_terminate_)(int);
  void (*previous_hang_up_)(int);
  void (*previous_pipe_)(int);
};

}  // namespace knuckle::cli
