#include "app/programs/program_console.h"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <iostream>
#include <utility>

namespace knuckle::programs {
namespace {

constexpr Duration kTendPeriod = 20ms, kStatusPeriod = 1s;

std::string seconds_text(Time at) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f s", to_seconds(at));
  return text;
}

}  // namespace

ProgramConsole::ProgramConsole(std::string program, std::ostream& out, bool terminal)
    : program_(std::move(program)), out_(out), terminal_(terminal) {}

ProgramConsole::ProgramConsole(std::string program)
    : ProgramConsole(std::move(program), std::cerr, isatty(STDERR_FILENO) == 1) {}

ProgramConsole::~ProgramConsole() {
  take_back();
  out_.flush();
}

void ProgramConsole::take_back() {
  if (shown_) out_ << "\r\033[K";
  shown_ = false;
}

void ProgramConsole::note(const std::string& what) {
  take_back();
  out_ << program_ << ": " << what << '\n' << std::flush;
}

void ProgramConsole::event(Time at, const std::string& what) {
  note(seconds_text(at) + ": " + what);
  shown_at_ = kNever;
}

void ProgramConsole::status(Time now, const std::string& line) {
  if (!terminal_ || now - shown_at_ < kStatusPeriod) return;
  take_back();
  out_ << program_ << ": " << line << std::flush;
  shown_ = true;
  shown_at_ = now;
}

void tend_until_over(const ProgramRun& run, const RealtimeClock& clock, const std::function<void(Time)>& tend) {
  for (;;) {
    const Time now = clock.now();
    tend(now);
    if (to_seconds(now) >= run.duration_s || (run.keep_on && !run.keep_on())) return;
    clock.sleep_until(now + kTendPeriod);
  }
}

void PolicyNote::tell(ProgramConsole& console, Time now, const RealtimeThread& thread) {
  if (told_) return;
  const auto policy = thread.granted();
  if (!policy) return;
  told_ = true;
  const bool real_time = policy->rfind("SCHED_FIFO", 0) == 0;
  console.event(now, std::string(loop_) + " loop runs as " + *policy +
                         (real_time ? "" : ": real time was not granted, see docs/realtime.md"));
}

double unix_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace knuckle::programs
