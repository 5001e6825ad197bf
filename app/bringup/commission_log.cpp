#include "app/bringup/commission_log.h"

#include <memory>

#include "recording/taped_wires.h"

namespace knuckle::bringup {

// Nothing here could tell of a stop, as the loops do: without a recording there are no flight records either.
CommissionLog::CommissionLog(const recordings::LogOptions& options, const recording::Head& head,
                             const MachineDescription& machine)
    : off_(options.off), drains_(head.simulated), log_(options, !head.simulated && !options.off, head, machine) {
  if (log_.recorder() != nullptr) tape_.record_to(log_.recorder()->machine_steps());
  if (!drains_) log_.begin();
}

BusAccess CommissionLog::taped(const BusAccess& access) {
  if (log_.recorder() == nullptr) return access;
  const auto inner = std::make_shared<BusAccess>(access);
  const auto wait = [this, inner](Time due) {
    tape_.end_step(inner->now(), ReasonCode::kNone);
    if (drains_) log_.recorder()->drain();
    inner->wait_until(due);
    return inner->now();
  };
  BusAccess taped(access.name(), std::make_shared<recording::TapedCan>(inner->bus(), tape_), wait);
  taped.press_e_stop = access.press_e_stop;
  taped.tape_m = access.tape_m;
  return taped;
}

Partner CommissionLog::noted(const Partner& partner, const BusAccess& access) {
  if (log_.recorder() == nullptr) return partner;
  const auto note = [this, &access](const std::string& kind, const std::string& text) {
    log_.recorder()->event({access.now(), recording::Severity::kInfo, kind, text});
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
  noted.ask = [note, ask = partner.ask](const Question& question) {
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

std::vector<std::string> CommissionLog::close() {
  log_.close();
  std::vector<std::string> lines;
  for (const cli::News& news : log_.news()) lines.push_back(news.what);
  return lines;
}

}  // namespace knuckle::bringup
