#include "app/cli/interrupt.h"

#include <time.h>

#include <atomic>
#include <csignal>
#include <cstdint>

namespace knuckle::cli {
namespace {

std::atomic<std::int64_t> first_ns{0};  // a handler can reach nothing else; 0: none has come
static_assert(std::atomic<std::int64_t>::is_always_lock_free);

void note_signal(int number) {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  const std::int64_t now_ns = t.tv_sec * std::int64_t{1'000'000'000} + t.tv_nsec;
  std::int64_t first = 0;
  if (first_ns.compare_exchange_strong(first, now_ns)) return;
  if (now_ns - first < std::chrono::nanoseconds(kSameWish).count()) return;
  std::signal(number, SIG_DFL);
  std::raise(number);  // held back until this handler has returned
}

}  // namespace

bool interrupt_pending() noexcept {
  return first_ns.load(std::memory_order_relaxed) != 0;
}

void check_interrupt() {
  if (interrupt_pending()) throw Interrupted();
}

InterruptGuard::InterruptGuard() noexcept {
  first_ns = 0;
  previous_interrupt_ = std::signal(SIGINT, note_signal);
  previous_terminate_ = std::signal(SIGTERM, note_signal);
  previous_hang_up_ = std::signal(SIGHUP, note_signal);
  previous_pipe_ = std::signal(SIGPIPE, SIG_IGN);  // a reader that left shows as a failed write, which is reported
  previous_file_size_ = std::signal(SIGXFSZ, SIG_IGN);
}

InterruptGuard::~InterruptGuard() {
  std::signal(SIGINT, previous_interrupt_);
  std::signal(SIGTERM, previous_terminate_);
  std::signal(SIGHUP, previous_hang_up_);
  std::signal(SIGPIPE, previous_pipe_);
  std::signal(SIGXFSZ, previous_file_size_);
}

void InterruptGuard::check() const {
  check_interrupt();
}

}  // namespace knuckle::cli
