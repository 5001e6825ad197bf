#include "app/bringup/dialogue_log.h"

#include <chrono>
#include <utility>

#include "app/cli/command.h"
#include "recording/tapped_wires.h"

namespace knuckle::bringup {

recording::Head dialogue_head(std::string command, std::string machine_file, bool simulated, Time now) {
  const std::chrono::nanoseconds unix_time = std::chrono::system_clock::now().time_since_epoch();
  recording::Head head;
  head.program = std::move(command);
  head.version = cli::program_version();
  if (!simulated) head.started_unix_ns = unix_time.count() - now.time_since_epoch().count();
  head.simulated = head.virtual_time = simulated;
  head.machine_file = std::move(machine_file);
  return head;
}

void neutral_where_interrupted(const cli::InterruptGuard& interrupt) {
  if (interrupt.pending()) throw cli::Interrupted("the machine is neutral");
}

// Nothing here could tell of a stop, as the loops do: without a recording there are no flight records either.
DialogueLog::DialogueLog(const recordings::LogOptions& options, const recording::Head& head,
                         const MachineDescription& machine, std::string kind)
    : off_(options.off),
      drains_(head.simulated),
      kind_(std::move(kind)),
      log_(options, !head.simulated && !options.off, head, machine),
      keeps_(log_.recorder() != nullptr && log_.problem().empty()) {
  if (recorder() != nullptr) tap_.record_to(recorder()->machine_steps());
  if (!drains_) log_.begin();
}

BusAccess DialogueLog::tapped(const BusAccess& access) {
  if (recorder() == nullptr) return access;
  bus_ = std::make_shared<BusAccess>(access);
  const auto wait = [this](Time due) {
    tap_.end_step(bus_->now(), ReasonCode::kNone);
    if (drains_) recorder()->drain();
    bus_->wait_until(due);
    return bus_->now();
  };
  BusAccess tapped(access.name(), std::make_shared<recording::TappedCan>(bus_->bus(), tap_), wait);
  tapped.press_e_stop = access.press_e_stop;
  tapped.tape_m = access.tape_m;
  return tapped;
}

recording::Recorder* DialogueLog::recorder() noexcept {
  return keeps_ ? log_.recorder() : nullptr;
}

void DialogueLog::note(recording::Severity severity, const std::string& kind, const std::string& text) {
  if (recorder() != nullptr && bus_) recorder()->event({bus_->now(), severity, kind, text});
}

Partner DialogueLog::noted(const Partner& partner) {
  if (recorder() == nullptr) return partner;
  const auto note = [this](const std::string& kind, const std::string& text) {
    this->note(recording::Severity::kInfo, kind, text);
  };
  Partner noted = partner;
  noted.say = [this, note, say = partner.say](const std::string& line) {
    note(kind_, line);
    say(line);
  };
  noted.begin = [this, note, begin = partner.begin](int number, const std::string& title) {
    note(kind_, "step " + std::to_string(number) + ": " + title);
    begin(number, title);
  };
  noted.ask = [this, note, say = partner.say, ask = partner.ask](const Question& question) {
    for (const cli::News& news : log_.news()) say(news.what);  // of the recording itself: it has it already
    note("question", text(question));
    ask(question);
  };
  noted.poll = [note, poll = partner.poll] {
    auto answer = poll();
    if (answer) note("answer", *answer);
    return answer;
  };
  return noted;
}

std::vector<std::string> DialogueLog::notes() const {
  return off_ ? std::vector<std::string>{"NOT RECORDED (--no-log)"} : log_.notes();
}

void DialogueLog::run(std::ostream& out, const std::function<void()>& work) {
  try {
    work();
  } catch (const std::exception& error) {
    note(recording::Severity::kError, kind_, error.what());
    close(out);
    throw;
  }
  close(out);
}

void DialogueLog::close(std::ostream& out) {
  if (bus_) tap_.end_step(bus_->now(), ReasonCode::kNone);  // what came since the last wait
  log_.close();
  for (const cli::News& news : log_.news()) out << news.what << '\n';
  if (recorder() != nullptr) out << "recorded in " << recorder()->status().file << '\n';
}

}  // namespace knuckle::bringup
