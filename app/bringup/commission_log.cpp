#include "app/bringup/commission_log.h"

#include "recording/taped_wires.h"

namespace knuckle::bringup {

// Nothing here could tell of a stop, as the loops do: without a recording there are no flight records either.
CommissionLog::CommissionLog(const recordings::LogOptions& options, const recording::Head& head,
                             const MachineDescription& machine)
    : off_(options.off),
      drains_(head.simulated),
      log_(options, !head.simulated && !options.off, head, machine),
      keeps_(log_.recorder() != nullptr && log_.problem().empty()) {
  if (recorder() != nullptr) tape_.record_to(recorder()->machine_steps());
  if (!drains_) log_.begin();
}

BusAccess CommissionLog::taped(const BusAccess& access) {
  if (recorder() == nullptr) return access;
  bus_ = std::make_shared<BusAccess>(access);
  const auto wait = [this](Time due) {
    tape_.end_step(bus_->now(), ReasonCode::kNone);
    if (drains_) recorder()->drain();
    bus_->wait_until(due);
    return bus_->now();
  };
  BusAccess taped(access.name(), std::make_shared<recording::TapedCan>(bus_->bus(), tape_), wait);
  taped.press_e_stop = access.press_e_stop;
  taped.tape_m = access.tape_m;
  return taped;
}

recording::Recorder* CommissionLog::recorder() noexcept {
  return keeps_ ? log_.recorder() : nullptr;
}

void CommissionLog::note(recording::Severity severity, const std::string& kind, const std::string& text) {
  if (recorder() != nullptr && bus_) recorder()->event({bus_->now(), severity, kind, text});
}

Partner CommissionLog::noted(const Partner& partner) {
  if (recorder() == nullptr) return partner;
  const auto note = [this](const std::string& kind, const std::string& text) {
    this->note(recording::Severity::kInfo, kind, text);
  };
  Partner noted = partner;
  noted.say = [note, say = partner.say](const std::string& line) {
    note("commission", line);
    say(line);
  };
  noted.begin = [note, begin = partner.begin](int number, const std::string& title) {
    note("commission", "step " + std::to_string(number) + ": " + title);
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

std::vector<std::string> CommissionLog::notes() const {
  return off_ ? std::vector<std::string>{"NOT RECORDED (--no-log)"} : log_.notes();
}

void CommissionLog::ended(const std::string& why) {
  note(recording::Severity::kError, "commission", why);
}

std::vector<std::string> CommissionLog::close() {
  if (bus_) tape_.end_step(bus_->now(), ReasonCode::kNone);  // what came since the last wait
  log_.close();
  std::vector<std::string> lines;
  for (const cli::News& news : log_.news()) lines.push_back(news.what);
  if (recorder() != nullptr) lines.push_back("recorded in " + recorder()->status().file);
  return lines;
}

}  // namespace knuckle::bringup
