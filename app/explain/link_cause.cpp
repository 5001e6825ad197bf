#include "app/explain/link_cause.h"

#include <fmt/format.h>

#include "app/explain/text.h"

namespace knuckle::explain {
namespace {

std::string silence(const Stream& stream) {
  return fmt::format("last at {} (usual every {}){}", at_text(*stream.last), span_text(stream.usual),
                     stream.next ? ", next at " + at_text(*stream.next) : ", none after it");
}

Cause unheard(const Stop& stop, const Window& window, const Evidence& evidence) {
  const Time since = evidence.to_operator.last.value_or(stop.at);
  Cause cause{"machine_unheard",
              "the machine's side fell silent at " + at_text(since) +
                  ": its program or computer died, or the way back from it is cut",
              {},
              {},
              since};
  cause.supports.push_back("the operator's side went on running and sending, and received nothing");
  const bool machine_recorded = !window.machine_steps.empty();
  const bool ran_on = machine_recorded && window.machine_steps.back().at > since + 100ms;
  if (!machine_recorded) {
    cause.against.emplace_back(
        "a dead program and a cut network look the same from here: see the recording of the machine's side");
  } else if (ran_on) {
    cause.id = "link_one_way_back";
    cause.text = "the way from the machine to the operator is cut since " + at_text(since) +
                 ": the machine's side ran on and sent, and nothing of it arrived";
  } else {
    cause.id = "machine_program_gone";
    cause.text = "the machine's program ended or hangs since " + at_text(window.machine_steps.back().at) +
                 ": it was killed, crashed, or its computer lost power";
    cause.supports.push_back("its loop has no step in the recording after " + at_text(window.machine_steps.back().at) +
                             ", while the operator's side has");
    cause.against.emplace_back("a cut network would have left the machine's own steps in the recording");
  }
  return cause;
}

Cause operator_gone(const Evidence& evidence, const Pause& pause, Time since) {
  const bool again = evidence.from_operator.next.has_value();
  return {"operator_program_paused",
          fmt::format("the operator's program {} from {} on{}",
                      again ? "was stopped or hung" : "ended, was killed or hangs", at_text(pause.from),
                      again ? " until " + at_text(pause.to) : ""),
          {"its loop has no step in the recording meanwhile, and sent nothing",
           "the machine's side ran and sent all the time"},
          {"the network is not to blame: there was nothing to carry"},
          since};
}

}  // namespace

std::optional<Cause> link_cause(const Stop& stop, const Window& window, const Evidence& evidence) {
  if (stop.machine_unheard) return unheard(stop, window, evidence);
  if (stop.reason.code != ReasonCode::kLinkLost) return std::nullopt;
  const Stream& heard = evidence.to_machine;
  const Time since = heard.last.value_or(stop.at);
  if (evidence.not_understood > 0) {
    return Cause{"link_content_damaged",
                 fmt::format("the operator's datagrams kept arriving, but none could be used since {}: impossible "
                             "numbers (not finite, out of range) or another version",
                             at_text(since)),
                 {fmt::format("{} datagrams in a row were refused", evidence.not_understood)},
                 {"the network is not to blame: it carried them; check the operator's program"},
                 since};
  }
  if (evidence.operator_pause && !window.operator_steps.empty())
    return operator_gone(evidence, *evidence.operator_pause, since);
  Cause cause{"link_cut", "", {}, {}, since};
  if (heard.last) cause.supports.push_back("the operator's messages as received by the machine: " + silence(heard));
  if (evidence.from_machine.last && !evidence.from_machine.silent())
    cause.supports.emplace_back("the machine's own datagrams kept leaving: its program is sound");
  if (window.operator_steps.empty()) {
    cause.text = "the operator's datagrams stopped arriving at " + at_text(since) +
                 " while the machine's own kept leaving: the network is cut, or the operator's program or computer "
                 "was stopped, killed, or lost power";
    cause.against.emplace_back(
        "which of the two it is cannot be told from the machine's side: see the recording of the operator's side");
    return cause;
  }
  if (!evidence.from_operator.silent())
    cause.supports.emplace_back("the operator's side went on sending: its program is sound");
  const bool back_too = evidence.to_operator.silent();
  cause.id = back_too ? "link_cut" : "link_one_way";
  cause.text = back_too ? "the network between the two sides is cut, both ways, since " + at_text(since) +
                              ": both went on sending, and neither heard the other"
                        : "the network is cut from the operator to the machine since " + at_text(since) +
                              ": the operator's side went on sending and hearing, the machine's side heard nothing";
  if (back_too && evidence.to_operator.last)
    cause.supports.push_back("the machine's messages as received by the operator: " + silence(evidence.to_operator));
  return cause;
}

}  // namespace knuckle::explain
