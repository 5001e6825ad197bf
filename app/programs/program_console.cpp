#include "app/programs/program_console.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>

#include "app/programs/program_options.h"
#include "core/text.h"

namespace knuckle::programs {
namespace {

constexpr Duration kTendPeriod = 20ms, kStatusPeriod = 1s;
constexpr std::size_t kMostBytes = 1 << 16;  // some hundred lines
constexpr std::size_t kColumns = 80;         // of a terminal that does not say

std::string seconds_text(Time at) {
  return fmt::format("{:.3f} s", to_seconds(at));
}

/// Of the terminal that standard error is.
std::size_t columns() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kColumns;
}

bool continues(char c) {  // a character of UTF-8 that has begun before
  return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U;
}

std::size_t characters(const std::string& text) {
  return text.size() - static_cast<std::size_t>(std::count_if(text.begin(), text.end(), continues));
}

void drop_last_character(std::string& text) {
  while (!text.empty() && continues(text.back())) text.pop_back();
  if (!text.empty()) text.pop_back();
}

}  // namespace

ProgramConsole::ProgramConsole(std::string program, std::ostream& out, bool terminal)
    : program_(std::move(program)), out_(out), terminal_(terminal) {}

ProgramConsole::ProgramConsole(std::string program)
    : program_(std::move(program)),
      own_(std::in_place, STDERR_FILENO, cli::BackgroundWriter::AfterRefusal::kGoOn, kMostBytes),
      out_(own_->stream()),
      terminal_(isatty(STDERR_FILENO) == 1) {}

ProgramConsole::~ProgramConsole() {
  tell_until(Time::max());
  tell_left_out(told_at_);
  take_back();
  out_.flush();
}

void ProgramConsole::take_back() {
  if (shown_) out_ << "\r\033[K";
  shown_ = false;
}

void ProgramConsole::say(const std::string& line) {
  take_back();
  out_ << program_ << ": " << printable(line) << '\n' << std::flush;  // a peer's name, a device's words
}

void ProgramConsole::note(const std::string& what) {
  tell_until(Time::max());
  say(what);
}

void ProgramConsole::event(Time at, const std::string& what, const std::string& kind) {
  waiting_.push_back({at, what, kind.empty() ? what : kind});
}

void ProgramConsole::tend(Time now) {
  // Loops hand their events over with the time of the step: what is younger than the last look may still get something
  // older before it.
  tell_until(now - kTendPeriod);
  if (now - span_began_ >= kEventSpan) tell_left_out(now);
  const std::uint64_t lost = lines_lost();
  if (lost == lost_told_ || !own_->idle()) return;
  say(std::to_string(lost - lost_told_) + " lines are missing here: standard error was not read in time");
  lost_told_ = lost;
}

void ProgramConsole::tell_until(Time until) {
  std::stable_sort(waiting_.begin(), waiting_.end(), [](const Event& a, const Event& b) { return a.at < b.at; });
  auto next = waiting_.begin();
  for (; next != waiting_.end() && next->at <= until; ++next) tell(*next);
  waiting_.erase(waiting_.begin(), next);
}

void ProgramConsole::tell(const Event& event) {
  if (span_began_ == kNever || event.at - span_began_ >= kEventSpan) {
    tell_left_out(event.at);
    span_began_ = event.at;
    told_in_span_ = 0;
  }
  told_at_ = event.at;
  const bool first = kinds_.first(event.kind);
  if (!first && told_in_span_ >= kMostEvents) {
    ++left_out_;
    return;
  }
  ++told_in_span_;
  say(seconds_text(event.at) + ": " + event.what);
  shown_at_ = kNever;
}

void ProgramConsole::tell_left_out(Time now) {
  if (left_out_ == 0) return;
  const Time until = std::min(now, span_began_ + kEventSpan);
  say(fmt::format("{}: ... and {} more events in the last {:.1f} s", seconds_text(until), left_out_,
                  to_seconds(until - span_began_)));
  left_out_ = 0;
}

void ProgramConsole::status(Time now, const std::vector<std::string>& parts) {
  if (!terminal_ || now - shown_at_ < kStatusPeriod) return;
  take_back();
  std::vector<std::string> line;
  for (const std::string& part : parts) line.push_back(printable(part));
  if (!line.empty()) line[0] = program_ + ": " + line[0];
  out_ << fitted(line, columns() - 1) << std::flush;  // the last column would begin the next line
  shown_ = true;
  shown_at_ = now;
}

std::string fitted(std::vector<std::string> parts, std::size_t width) {
  const std::string between = " | ", cut = "...";
  const auto length = [&] {
    std::size_t sum = parts.empty() ? 0 : between.size() * (parts.size() - 1);
    for (const std::string& part : parts) sum += characters(part);
    return sum;
  };
  while (length() > width) {
    auto& longest = *std::max_element(parts.begin(), parts.end(), [](const std::string& a, const std::string& b) {
      return characters(a) < characters(b);
    });
    if (longest.ends_with(cut)) longest.resize(longest.size() - cut.size());
    if (longest.empty()) break;
    drop_last_character(longest);
    longest += cut;
  }
  std::string line;
  for (const std::string& part : parts) line += (line.empty() ? "" : between) + part;
  return line;
}

void tend_until_over(const ProgramRun& run, const RealtimeClock& clock, const std::function<void(Time)>& tend) {
  for (;;) {
    const Time now = clock.now();
    tend(now);
    for (AskedOutput* output : run.outputs) {
      if (const std::string refused = output->tend(); !refused.empty()) run.console.event(now, refused);
    }
    if (run.news) {
      for (const cli::News& news : run.news()) run.console.event(now, news.what, news.kind);
    }
    run.console.tend(now);
    if (to_seconds(now) >= run.duration_s || (run.keep_on && !run.keep_on())) return;
    clock.sleep_until(now + kTendPeriod);
  }
}

namespace {

void tell_policy(ProgramConsole& console, Time now, const std::string& loop, const std::string& policy) {
  const bool real_time = policy.rfind("SCHED_FIFO", 0) == 0, all = policy.find(',') == std::string::npos;
  console.event(now, loop + " loop runs as " + policy +
                         (real_time && all ? "" : ": real time was not granted in full, see docs/installing.md"));
}

}  // namespace

bool StandingReason::is_news(Time now, const Reason& blocking) noexcept {
  if (!same_cause(blocking, standing_)) since_ = now;
  standing_ = blocking;
  if (!standing_ || same_cause(standing_, told_) || now - since_ < 1s) return false;
  told_ = standing_;
  return true;
}

LoopRun run_loop(const ProgramRun& run, const LoopPlan& plan) {
  const RealtimeClock clock;
  RealtimeThread loop(plan.thread, clock, plan.step);
  bool told = false;
  const auto tend = [&](Time now) {
    if (const auto policy = told ? std::nullopt : loop.granted()) {
      told = true;
      tell_policy(run.console, now, plan.thread.name, *policy);
    }
    plan.tend(now);
  };
  tend_until_over(run, clock, tend);
  if (plan.ask_to_stop) {
    plan.ask_to_stop();
    ProgramRun ending = run;
    ending.keep_on = [&plan] { return !plan.stopped(); };
    ending.duration_s = std::numeric_limits<double>::infinity();
    tend_until_over(ending, clock, tend);
  }
  loop.stop();
  tend(clock.now());
  return {loop.report(), clock.now()};
}

double unix_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace knuckle::programs
