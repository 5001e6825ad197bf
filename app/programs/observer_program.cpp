#include "app/programs/observer_program.h"

namespace knuckle::programs {
namespace {

constexpr Duration kSilence = 1s;

/// What an event says, without its values.
std::string kind_of(const ObservedEvent& event) {
  return event.heard ? std::string(name(event.mode)) + " " + name(event.fault.code) : "not heard";
}

std::string text_of(const ObservedEvent& event) {
  if (!event.heard) return "machine: no packets received";
  return std::string("machine ") + name(event.mode) + (event.fault ? " " + text_with_code(event.fault) : "");
}

}  // namespace

void Observer::tend(Time now) {
  (void)link_.send({});  // nothing is sent, but the link may say that somebody is here
  Datagram datagram;
  while (link_.receive(datagram)) {
    const auto message = decode_slave(datagram.view());
    if (!message) continue;
    ++messages_;
    if (newest_ && now - heard_at_ < kSilence && !newer(message->stamp.sequence, newest_->stamp.sequence)) continue;
    newest_ = message;
    heard_at_ = now;
  }
  tell(now);
}

void Observer::tell(Time now) {
  ObservedEvent event{to_seconds(now), newest_ && now - heard_at_ < kSilence, {}, {}};
  if (event.heard) {
    event.mode = newest_->mode;
    event.fault = newest_->fault;
  }
  if (event.heard != last_.heard || event.mode != last_.mode || !same_cause(event.fault, last_.fault)) {
    last_ = event;
    events_.add(event, kind_of(event));
    console_.event(now, text_of(event), kind_of(event));
  }
  console_.status(now, {text_of(event)});
}

ObserverOutcome Observer::outcome(double ran_s) const {
  return {events_.kept(), messages_, ran_s, events_.left_out()};
}

ObserverOutcome run_observer(Link& link, const ProgramRun& run) {
  Observer observer(link, run.console);
  const RealtimeClock clock;
  tend_until_over(run, clock, [&observer](Time now) { observer.tend(now); });
  return observer.outcome(to_seconds(clock.now()));
}

}  // namespace knuckle::programs
