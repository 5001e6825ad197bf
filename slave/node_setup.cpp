#include "slave/node_setup.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "machine/reason_text.h"

namespace knuckle::slave {
namespace {

using canopen::Object;
using Kind = SetupPart::Kind;
using Match = SdoStep::Match;

}  // namespace

std::vector<std::string> guard_lines(const BusDescription& bus, const std::function<bool(std::uint8_t)>& same_device) {
  std::vector<std::string> lines, never;
  for (const NodeDescription& node : bus.nodes) {
    using Changed = GuardProof::Changed;
    const GuardProof& proof = node.guard;
    const bool moves_none = node.role == NodeRole::kModule && !moves_joints(bus, node.id);
    if (!node.is_told() || moves_none) continue;
    if (!node.unguarded.empty())
      lines.push_back(node.name + " may have no guard, as the machine file says: " + node.unguarded);
    else if (proof.date.empty())
      never.push_back(node.name);
    else if (!proof.proved)
      lines.push_back("the guard of " + node.name + " was tried on " + proof.date + " and not proved");
    else if (proof.changed == Changed::kDevice || !same_device(node.id))
      lines.push_back("the guard of " + node.name + " was proved on " + proof.date + ", of another device");
    else if (proof.changed != Changed::kNothing)
      lines.push_back("the guard of " + node.name + " was proved on " + proof.date +
                      (proof.changed == Changed::kChannels ? ", with other channels than the machine file now has"
                       : proof.changed == Changed::kTimes
                           ? ", with other times than the machine file now has (valve_watchdog_ms, "
                             "controller_timeout_ms)"
                           : ", and its record does not say with which channels and times"));
  }
  if (!never.empty())
    lines.push_back(fmt::format("never proved to stop without its controller: {}; knuckle commission proves it",
                                fmt::join(never, ", ")));
  return lines;
}

bool SdoStep::holds(std::uint32_t found) const noexcept {
  constexpr std::uint32_t kNoRemoteRequests = 0x40000000;
  switch (match) {
    case Match::kEqual:
      return found == value;
    case Match::kAtLeast:
      return found >= value && found <= canopen::kMostMapped;
    case Match::kOff:
      return (found & canopen::kPdoDisabled) != 0;
    case Match::kPeriod:
      return found >= value >> 16 && found <= (value & 0xFFFFU);
    case Match::kCobId:
      return (found & ~kNoRemoteRequests) == (value & ~kNoRemoteRequests);
  }
  return false;
}

std::string period_text(const SdoStep& step) {
  return fmt::format("{} ms to {} ms (sync_Hz, sensor_age_limit_ms)", step.value >> 16, step.value & 0xFFFFU);
}

std::string text(const SetupFailure& failure, const BusDescription& bus) {
  const SdoStep& step = failure.step;
  const std::string node = node_text(failure.node, bus) + ": ";
  const std::string object = fmt::format("0x{:04X}:{:02X} ", step.object.index, step.object.subindex);
  const std::string what = node + (failure.writing ? "writing " : "reading ") + object;
  if (step.match == SdoStep::Match::kPeriod && failure.what != SetupFailure::What::kSilent) {
    const bool unread = failure.what == SetupFailure::What::kAborted && !failure.writing;
    return node +
           fmt::format("its transmission type 0x{:04X}:02 cannot be changed, and its own timer ", step.object.index) +
           object + (unread ? "cannot be read" : fmt::format("is {} ms", failure.seen)) + ": it must be " +
           period_text(step);
  }
  switch (failure.what) {
    case SetupFailure::What::kSilent:
      return what + "was not answered: check its power, cable and node id";
    case SetupFailure::What::kAborted:
      return what + fmt::format("was refused: {} (SDO abort 0x{:08X})", canopen::abort_text(failure.abort),
                                static_cast<unsigned>(failure.abort));
    case SetupFailure::What::kOtherValue:
      return what + fmt::format("gave 0x{:X}, the machine file says 0x{:X}", failure.seen, step.value);
    case SetupFailure::What::kNotKept:
      return what + fmt::format("gave 0x{:X} after 0x{:X} was written", failure.seen, step.value);
    case SetupFailure::What::kUnguarded:
      return node + "takes no guard (" + object +
             "was the last one tried): without its controller it would not stop. Set one by its manual, or say in its "
             "table of the machine file what else stops it: unguarded = \"why\"";
    case SetupFailure::What::kNone:
      break;
  }
  return "";
}

SdoDialogue::SdoDialogue(std::uint8_t node, SdoScript script, Duration timeout)
    : node_(node), timeout_(timeout), script_(std::move(script)), taken_(script_.size()) {
  restart();
}

void SdoDialogue::restart() noexcept {
  part_ = 0;
  at_ = 0;
  doing_ = !script_.empty() && script_.front().asked.empty() ? Doing::kWriting : Doing::kAsking;
  answered_ = false;
  same_device_ = true;
  std::fill(taken_.begin(), taken_.end(), false);
  asked_ = 0;
  asked_at_ = kNever;
  failure_ = {};
  details_ = {};
  // What is still to be answered may be answered beside the first request of this start.
  requests_ = std::clamp<std::int64_t>(requests_ - answers_, 0, 1);
  answers_ = 0;
  read_ = {};
  second_ = 0;
}

const SdoStep& SdoDialogue::current() const noexcept {
  const SetupPart& part = script_[part_];
  return doing_ == Doing::kWriting ? part.written[at_] : part.asked[at_];
}

void SdoDialogue::next_part() noexcept {
  const auto guards = [this](std::size_t part) { return part < script_.size() && script_[part].kind == Kind::kGuard; };
  bool any = false;
  for (std::size_t i = 0; i <= part_; ++i) any = any || (guards(i) && taken_[i]);
  if (guards(part_) && !guards(part_ + 1) && !any) return fail(SetupFailure::What::kUnguarded);
  ++part_;
  if (part_ < script_.size() && script_[part_].kind == Kind::kTimer && !by_own_timer(value_)) ++part_;
  at_ = 0;
  doing_ = part_ < script_.size() && script_[part_].asked.empty() ? Doing::kWriting : Doing::kAsking;
}

/// The current step is as it should be.
void SdoDialogue::go_on() noexcept {
  const SetupPart& part = script_[part_];
  asked_ = 0;
  if (++at_ < (doing_ == Doing::kWriting ? part.written : part.asked).size()) return;
  if (doing_ == Doing::kWriting && !part.asked.empty()) {
    at_ = 0;
    doing_ = Doing::kAskingAgain;
    return;
  }
  taken_[part_] = true;
  next_part();
}

bool SdoDialogue::took(Object guard) const noexcept {
  for (std::size_t i = 0; i < script_.size(); ++i) {
    if (taken_[i] && !script_[i].asked.empty() && script_[i].asked.front().object == guard) return true;
  }
  return false;
}

void SdoDialogue::on_other_value(std::uint32_t seen) noexcept {
  details_.seen = seen;
  if (doing_ == Doing::kAskingAgain) return refused(SetupFailure::What::kNotKept);
  if (script_[part_].kind == Kind::kProof) return refused(SetupFailure::What::kOtherValue);
  if (script_[part_].written.empty()) return fail(SetupFailure::What::kOtherValue);
  asked_ = 0;
  at_ = 0;
  doing_ = Doing::kWriting;
}

/// A guard may be missing where another one is there.
void SdoDialogue::refused(SetupFailure::What what) noexcept {
  const Kind kind = script_[part_].kind;
  if (kind == Kind::kProof) same_device_ = false;
  const bool sends_anyway = kind == Kind::kTransmission && doing_ != Doing::kAsking && by_own_timer(value_);
  if (kind != Kind::kGuard && kind != Kind::kOptional && kind != Kind::kProof && !sends_anyway) return fail(what);
  asked_ = 0;
  next_part();
}

/// Another identity is another device; everything else is a set-up that did not work.
void SdoDialogue::fail(SetupFailure::What what) noexcept {
  const SdoStep& step = current();
  details_.what = what;
  details_.node = node_;
  details_.step = step;
  details_.writing = doing_ == Doing::kWriting;
  if (what == SetupFailure::What::kOtherValue && script_[part_].kind == Kind::kIdentity) {
    failure_ = {ReasonCode::kNodeIdentity, node_, double(details_.seen), double(step.value)};
  } else {
    failure_ = {ReasonCode::kNodeSetup, node_, double(part_), double(script_.size())};
  }
}

/// A PDO that is on may only be turned off, not be given another identifier (CiA 301).
std::uint32_t SdoDialogue::to_write(const SdoStep& step) const noexcept {
  if (step.match == Match::kPeriod) return step.value >> 16;
  return step.match == Match::kOff ? value_ | canopen::kPdoDisabled : step.value;
}

bool SdoDialogue::step(CanBus& bus, Time now) noexcept {
  if (done() || failure_ || (asked_ > 0 && now - asked_at_ < timeout_)) return false;
  const SdoStep& step = current();
  if (asked_ > 0) {
    // The node is told that its answer is not waited for any more (CiA 301), or it may take the next request for a
    // part of this one.
    bus.send(canopen::sdo_abandoned(node_, step.object, canopen::SdoAbort::kTimeout));
    if (asked_ == kSdoAttempts) {
      fail(SetupFailure::What::kSilent);
      return false;
    }
  }
  const bool sent =
      bus.send(doing_ == Doing::kWriting ? canopen::sdo_download(node_, step.object, to_write(step), step.size)
                                         : canopen::sdo_upload(node_, step.object));
  if (!sent) return false;  // queue full: again in the next step
  ++requests_;
  ++asked_;
  asked_at_ = now;
  return true;
}

/// One device answers a request once at most, be it late.
void SdoDialogue::count(const canopen::SdoResponse& answer) noexcept {
  if (++answers_ <= requests_) return;
  const bool other =
      answer.kind == canopen::SdoResponse::Kind::kUploaded && answer.object == read_ && answer.value != value_;
  second_ = std::min(2, second_ + (other ? 2 : 1));
}

/// The device has no such object, or lets nobody set it; another abort may pass.
bool is_missing(canopen::SdoAbort abort) noexcept {
  using canopen::SdoAbort;
  return abort == SdoAbort::kNoObject || abort == SdoAbort::kNoSubindex || abort == SdoAbort::kReadOnly ||
         abort == SdoAbort::kUnsupportedAccess || abort == SdoAbort::kInvalidValue;
}

void SdoDialogue::receive(const CanFrame& frame) noexcept {
  if (done() || requests_ == 0) return;
  const auto answer = canopen::parse_sdo_response(frame);
  if (!answer) return;
  count(*answer);
  if (failure_ || asked_ == 0 || answer->object != current().object) return;  // a late answer to an earlier attempt
  using Answer = canopen::SdoResponse::Kind;
  const bool writing = doing_ == Doing::kWriting;
  // Of an object that is read and written in turn, an answer to the other request is late, or a second device's.
  if (answer->kind == (writing ? Answer::kUploaded : Answer::kDownloaded)) return;
  answered_ = true;
  if (answer->kind != (writing ? Answer::kDownloaded : Answer::kUploaded)) {
    details_.abort = answer->kind == Answer::kAborted ? answer->abort : canopen::SdoAbort::kUnknownCommand;
    const Kind kind = script_[part_].kind;
    const bool may_lack = kind == Kind::kOptional || kind == Kind::kProof;
    return may_lack || is_missing(details_.abort) ? refused(SetupFailure::What::kAborted)
                                                  : fail(SetupFailure::What::kAborted);
  }
  if (writing) return go_on();
  read_ = answer->object;
  value_ = answer->value;
  if (!current().holds(answer->value)) return on_other_value(answer->value);
  go_on();
}

}  // namespace knuckle::slave
