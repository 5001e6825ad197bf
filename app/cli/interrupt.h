// Ctrl-C ends a session in order: through an exception, so that no half-written file stays behind.
#pragma once

#include <chrono>
#include <exception>
#include <string>

namespace knuckle::cli {

class Interrupted : public std::exception {
 public:
  /// @param kept what has become of the work.
  explicit Interrupted(const std::string& kept = "nothing was written") : text_("interrupted; " + kept) {}
  [[nodiscard]] const char* what() const noexcept override { return text_.c_str(); }

 private:
  std::string text_;
};

/// Signals within so long of the first are the same wish: `timeout`, terminals and supervisors send it to a program and
/// to its group. A machine is in order neutral before a second one counts.
inline constexpr std::chrono::seconds kSameWish{1};

/// A signal has come that some InterruptGuard notes. Any thread.
[[nodiscard]] bool interrupt_pending() noexcept;
/// For long work, in between; any thread. @throws Interrupted once such a signal has come.
void check_interrupt();

/// While one lives, SIGINT, SIGTERM and SIGHUP are noted instead of ending the program at once; a later one does end
/// it, whatever it is at. Writing to a reader that left, or beyond a limit of file size, is an error of that write
/// only.
class InterruptGuard {
 public:
  InterruptGuard() noexcept;
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// A signal has come.
  [[nodiscard]] bool pending() const noexcept { return interrupt_pending(); }
  /// @throws Interrupted once a signal has come.
  void check() const;

 private:
  void (*previous_interrupt_)(int);
  void (*previous_terminate_)(int);
  void (*previous_hang_up_)(int);
  void (*previous_pipe_)(int);
  void (*previous_file_size_)(int);
};

}  // namespace knuckle::cli
