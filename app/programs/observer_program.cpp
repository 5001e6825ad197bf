#include "app/programs/observer_program.h"

#include <optional>

namespace knuckle::programs {
namespace {

constexpr Duration kSilence = 1s;

class Observer {
 public:
  Observer(Link& link, ProgramConsole& console, const std::function<std::string()>& problem, ObserverOutcome& outcome)
      : link_(link), console_(console), problem_of_(problem), outcome_(outcome) {}

  void tend(Time now) {
    (void)link_.send({});  // nothing is sent, but the link may say that somebody is here
    Datagram datagram;
    while (link_.receive(datagram)) {
      const auto message = decode_slave(datagram.view());
      if (!message) continue;
      ++outcome_.messages;
      if (newest_ && now - heard_at_ < kSilence && !newer(message->stamp.sequence, newest_->stamp.sequence)) continue;
      newest_ = message;
      heard_at_ = now;
    }
    tell(now);
  }

 private:
  void tell(Time now) {
    ObservedEvent event{to_seconds(now), newest_ && now - heard_at_ < kSilence, {}, {}};
    if (event.heard) {
      event.mode = newest_->mode;
      event.fault = newest_->fault;
    }
    if (event.heard != last_.heard || event.mode != last_.mode || !same_cause(event.fault, last_.fault)) {
      last_ = event;
      if (outcome_.events.size() == ObserverOutcome::kMostEvents) outcome_.events.erase(outcome_.events.begin());
      outcome_.events.push_back(event);
      console_.event(now, text_of(event));
    }
    if (const std::string problem = problem_of_(); problem != problem_) {
      problem_ = problem;
      if (!problem.empty()) console_.event(now, problem);
    }
    console_.status(now, {text_of(event)});
  }
  static std::string text_of(const ObservedEvent& event) {
    if (!event.heard) return "machine: no packets received";
    return std::string("machine ") + name(event.mode) + (event.fault ? " " + text_with_code(event.fault) : "");
  }

  Link& link_;
  ProgramConsole& console_;
  const std::function<std::string()>& problem_of_;
  ObserverOutcome& outcome_;
  std::optional<SlaveMessage> newest_;
  Time heard_at_{};
  ObservedEvent last_;
  std::string problem_;
};

}  // namespace

ObserverOutcome run_observer(Link& link, const ProgramRun& run, const std::function<std::string()>& problem) {
  ObserverOutcome outcome;
  Observer observer(link, run.console, problem, outcome);
  const RealtimeClock clock;
  tend_until_over(run, clock, [&observer](Time now) { observer.tend(now); });
  outcome.ran_s = to_seconds(clock.now());
  return outcome;
}

}  // namespace knuckle::programs
