#include "core/realtime_thread.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace knuckle {
namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

std::int64_t monotonic_ns() noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * kNanosecondsPerSecond + t.tv_nsec;
}

/// Where locking is limited, a lock of all future pages would make a later allocation fail: then rather not at all.
bool lock_all_memory() noexcept {
  rlimit limit{};
  const bool unlimited = geteuid() == 0 || (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
  return unlimited && mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
}

/// Read back, because the request may not have been granted.
struct Granted {
  std::string policy;
  int fifo_priority = 0;
};
Granted granted_policy() {
  int policy = 0;
  sched_param parameters{};
  pthread_getschedparam(pthread_self(), &policy, &parameters);
  const std::string priority = std::to_string(parameters.sched_priority);
  if (policy == SCHED_FIFO) return {"SCHED_FIFO " + priority, parameters.sched_priority};
  if (policy == SCHED_RR) return {"SCHED_RR " + priority};
  return {policy == SCHED_OTHER ? "SCHED_OTHER" : "policy " + std::to_string(policy)};
}

/// The first multiple of period after now.
Time next_multiple(Time now, Duration period) noexcept {
  return Time((now.time_since_epoch() / period + 1) * period);
}

}  // namespace

void ask_for_fifo(int priority) noexcept {
  sched_param parameters{};
  parameters.sched_priority = priority;
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
}

RealtimeClock::RealtimeClock(Time now) noexcept : epoch_ns_(monotonic_ns() - now.time_since_epoch().count()) {}

Time RealtimeClock::now() const noexcept {
  return Time(Duration(monotonic_ns() - epoch_ns_));
}

void RealtimeClock::sleep_until(Time wake) const noexcept {
  const std::int64_t at = wake.time_since_epoch().count() + epoch_ns_;
  const timespec t{at / kNanosecondsPerSecond, at % kNanosecondsPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

void PeriodicSchedule::advance(Time done) noexcept {
  next_ += period_;
  if (done < next_) return;
  const auto missed = (done - next_) / period_ + 1;
  next_ += missed * period_;
  skipped_ += static_cast<std::uint64_t>(missed);
}

RealtimeThread::RealtimeThread(RealtimeOptions options, const RealtimeClock& clock, std::function<void(Time)> step)
    : options_(std::move(options)), clock_(clock), step_(std::move(step)), thread_([this] { run(); }) {}

RealtimeThread::~RealtimeThread() {
  stop();
}

void RealtimeThread::stop() {
  stop_.store(true, std::memory_order_relaxed);
  if (thread_.joinable()) thread_.join();
}

std::optional<std::string> RealtimeThread::granted() const {
  if (!begun_.load(std::memory_order_acquire)) return std::nullopt;
  return report_.policy + (options_.lock_memory && !report_.memory_locked ? ", its memory may be swapped out" : "");
}

void RealtimeThread::run() noexcept {
  pthread_setname_np(pthread_self(), options_.name.substr(0, 15).c_str());
  prctl(PR_SET_TIMERSLACK, 1UL);  // Without SCHED_FIFO a sleep may otherwise end 50 us late on purpose.
  if (options_.lock_memory) report_.memory_locked = lock_all_memory();
  if (options_.fifo_priority > 0) ask_for_fifo(options_.fifo_priority);
  const Granted granted = granted_policy();
  report_.policy = granted.policy;
  begun_.store(true, std::memory_order_release);

  std::optional<LoopHealthMeter> meter;
  if (options_.health != nullptr)
    meter.emplace(*options_.health, granted.policy, granted.fifo_priority, options_.period);
  PeriodicSchedule schedule(next_multiple(clock_.now() - options_.phase, options_.period) + options_.phase,
                            options_.period);
  while (!stop_.load(std::memory_order_relaxed)) {
    clock_.sleep_until(schedule.next());
    const Time woke = clock_.now();
    step_(woke);
    const Time done = clock_.now();
    const Duration late = woke - schedule.next(), took = done - woke;
    report_.wake_lateness.add(late);
    report_.execution.add(took);
    ++report_.steps;
    schedule.advance(done);
    if (meter) meter->note(done, late, took, schedule.skipped());
  }
  report_.overruns = schedule.skipped();
}

}  // namespace knuckle
