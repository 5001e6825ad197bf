#include "transport/ice/path.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "transport/ice/signal.h"

namespace knuckle::ice {

namespace {

constexpr std::uint8_t kQuestion = 0, kQuestionInUse = 1, kAnswer = 2;
constexpr std::size_t kNumberAt = 2;

Beat beat_of(std::uint8_t what, std::span<const std::uint8_t> number) {
  Beat beat{kBeatMark, what};
  std::copy(number.begin(), number.end(), beat.begin() + kNumberAt);
  return beat;
}

}  // namespace

std::optional<Beat> Heartbeat::question(Clock::time_point now, bool in_use) {
  if (now - asked_at_ < kEvery) return std::nullopt;
  asked_at_ = now;
  Asked& asked = asked_[next_++ % asked_.size()];
  const Nonce random = random_nonce();
  std::copy_n(random.begin(), asked.number.size(), asked.number.begin());
  asked.at = now;
  asked.open = true;
  return beat_of(in_use ? kQuestionInUse : kQuestion, asked.number);
}

std::optional<Beat> Heartbeat::hear(std::span<const std::uint8_t> datagram, Clock::time_point now) {
  if (!is_beat(datagram) || datagram[1] > kAnswer) return std::nullopt;
  const auto number = datagram.subspan(kNumberAt);
  if (datagram[1] != kAnswer) {
    heard_at_ = now;
    far_end_uses_ = far_end_uses_ || datagram[1] == kQuestionInUse;
    return beat_of(kAnswer, number);
  }
  for (Asked& asked : asked_) {
    if (!asked.open || !std::equal(number.begin(), number.end(), asked.number.begin())) continue;
    asked.open = false;
    answered_at_ = now;
    round_trip_ = now - asked.at;
  }
  return std::nullopt;
}

std::optional<Heartbeat::Clock::duration> Heartbeat::take_round_trip() noexcept {
  return std::exchange(round_trip_, std::nullopt);
}

namespace {

using namespace std::chrono_literals;

constexpr auto kLostAfter = 1000ms;     // without an answer
constexpr auto kAttemptLasts = 8000ms;  // then another is begun; ...
// ... with addresses of before a change so long: not shorter, or a network that always changes would let none succeed.
constexpr auto kOutdatedLasts = 1000ms;
constexpr auto kRepeatOffer = 1000ms;  // without an answer
constexpr auto kRelayMissed = 3000ms;  // without an address of it
constexpr auto kGather = 50ms;         // candidates are told together
constexpr auto kPairsSettle = 300ms;   // better pairs follow the first within it
constexpr auto kLinger = 1000ms;
constexpr auto kFirstBackOff = 500ms, kLongestBackOff = 4000ms;
constexpr auto kFirstImprove = 10'000ms, kLongestImprove = 60'000ms;
constexpr auto kMostOften = 200ms;  // answers to unproven signals, hellos, new offers
constexpr auto kHoldSession = 3000ms;
constexpr auto kHelloEvery = 2000ms;  // while there is no path
constexpr std::size_t kMostHeld = 4;
constexpr std::uint8_t kHandshakeRecord = 22;
constexpr int kMostRead = 64;

}  // namespace

std::string text(const PathEvent& event) {
  const std::string to = "path to " + event.far_end + ": ";
  switch (event.kind) {
    case PathEvent::Kind::kSearching:
      return to + "searching";
    case PathEvent::Kind::kInUse: {
      std::array<char, 32> time{};
      std::snprintf(time.data(), time.size(), "%.2f ms",
                    std::chrono::duration<double, std::milli>(event.round_trip).count());
      return to + "in use: " + name(event.pair.kind) + ", " + text(event.pair.local) + " to " +
             text(event.pair.remote) + ", round trip " + time.data();
    }
    case PathEvent::Kind::kLost:
      return to + "lost: nothing has come through for 1 s: searching another, should the far end still run";
    case PathEvent::Kind::kBack:
      return to + "back: the same one carries again";
    case PathEvent::Kind::kFailed:
      return to + "none found: do firewalls let UDP out? Two NATs may need a relay (--turn); trying again";
    case PathEvent::Kind::kNoRelay:
      return to + "no relay: " + event.relay + " (--turn) gives no address: is it there, and does it know user and " +
             "password of turn.toml?";
  }
  return to;
}

Path::Path(Setup setup, const Signer& signer, UdpSocket to_link)
    : setup_(std::move(setup)),
      conversation_(signer, setup_.far_end.fingerprint),
      to_link_(std::move(to_link)),
      back_off_(kFirstBackOff),
      improve_after_(kFirstImprove) {
  link_readable_ = GlibSource::readable(setup_.context, to_link_.descriptor(), [this] { read_link(); });
}

void Path::report(PathEvent::Kind kind, Clock::time_point now) {
  setup_.report({kind, now, setup_.far_end.name, reported_.value_or(PathPair{}), round_trip_, setup_.relay});
}

// ---------------------------------------------------------------------------------------------------------- signals

void Path::hear(std::span<const std::uint8_t> bytes, Clock::time_point now) {
  // Two processes with the same key: the first stays as long as its path carries, and has the time to find one.
  const bool open = lost_ || (!current_ && now - session_at_ > kHoldSession);
  const Conversation::Heard heard = conversation_.hear(bytes, open);
  const Signal& signal = heard.signal;
  if (heard.verdict == Conversation::Verdict::kRefused || heard.verdict == Conversation::Verdict::kOther) return;
  if (heard.verdict == Conversation::Verdict::kUnproven) {
    if (now - answered_at_ < kMostOften) return;
    answered_at_ = now;
    return setup_.signal(conversation_.answer(signal));
  }
  if (heard.new_session) {
    ++sessions_;
    session_at_ = now;
    attempt_.reset();
    wanted_ = true;
    begin_at_ = now;
    report(PathEvent::Kind::kSearching, now);
  }
  // The operator's side repeats its hello until it has heard this side: an answer may have been lost.
  if (!operates() && signal.kind == Signal::Kind::kHello && (heard.new_session || now - answered_at_ >= kMostOften)) {
    answered_at_ = now;
    say({});
  }
  if (operates()) {
    if (signal.kind == Signal::Kind::kAgain) network_changed(now);
    if (signal.kind != Signal::Kind::kAnswer) return;
    for (Attempt* one : {attempt_.get(), current_.get()}) {
      if (one == nullptr || one->number != signal.attempt || one->session != sessions_) continue;
      one->answered = true;
      one->agent->set_far_end(signal);
    }
  } else if (signal.kind == Signal::Kind::kOffer) {
    take_offer(signal, now);
  }
  setup_.wake();
}

/// Machine's side. The same one again brings more candidates.
void Path::take_offer(const Signal& offer, Clock::time_point now) {
  for (Attempt* one : {attempt_.get(), current_.get()}) {
    if (one == nullptr || one->number != offer.attempt || one->session != sessions_) continue;
    one->agent->set_far_end(offer);
    one->told = 0;  // the answer may have been lost
    return;
  }
  if (attempt_ && now - attempt_->begun < kMostOften) return;
  begin(offer.attempt, offer.direct_only, now);
  attempt_->agent->set_far_end(offer);
}

void Path::somebody_there(Clock::time_point now) {
  if (now - greeted_at_ < kMostOften) return;
  greeted_at_ = now;
  say({});
}

void Path::network_changed(Clock::time_point now) {
  if (!knows_far_end()) return;  // nothing has begun that it could concern
  changed_at_ = now;
  wanted_ = true;
  begin_at_ = std::min(begin_at_, now);
  back_off_ = kFirstBackOff;
  improve_after_ = kFirstImprove;
}

/// Machine's side, after a change: the operator's side begins attempts.
void Path::ask_for_attempt(Clock::time_point now) {
  if (changed_at_ <= said_again_at_ || now - said_again_at_ < kRepeatOffer) return;
  said_again_at_ = now;
  Signal again;
  again.kind = Signal::Kind::kAgain;
  say(std::move(again));
}

void Path::begin(std::uint32_t number, bool direct_only, Clock::time_point now) {
  auto attempt = std::make_unique<Attempt>();
  attempt->number = number;
  attempt->session = sessions_;
  attempt->direct_only = direct_only;
  attempt->begun = now;
  AgentSetup agent = setup_.agent(direct_only);
  agent.controlling = operates();
  Attempt* raw = attempt.get();
  attempt->agent = std::make_unique<Agent>(setup_.context, agent, setup_.wake,
                                           [this, raw](std::span<const std::uint8_t> bytes) { received(*raw, bytes); });
  attempt_ = std::move(attempt);
}

void Path::tell_candidates(Attempt& attempt, Clock::time_point now) {
  if (now - attempt.begun < kGather || now - attempt.told_at < kGather) return;
  std::vector<Candidate> candidates = attempt.agent->candidates();
  const bool complete = attempt.agent->gathered();
  if (!setup_.relay.empty() && !attempt.direct_only)
    look_for_relay(candidates, complete || now - attempt.begun > kRelayMissed, now);
  const bool more = candidates.size() != attempt.told || complete != attempt.told_complete;
  const bool again = operates() && !attempt.answered && now - attempt.told_at >= kRepeatOffer;
  if (candidates.empty() || (!more && !again)) return;
  attempt.told_at = now;
  attempt.told = candidates.size();
  attempt.told_complete = complete;
  Signal signal;
  signal.kind = operates() ? Signal::Kind::kOffer : Signal::Kind::kAnswer;
  signal.attempt = attempt.number;
  signal.direct_only = attempt.direct_only;
  signal.complete = complete;
  signal.user = attempt.agent->user();
  signal.password = attempt.agent->password();
  signal.candidates = std::move(candidates);
  say(std::move(signal));
}

void Path::look_for_relay(const std::vector<Candidate>& candidates, bool over, Clock::time_point now) {
  const bool there = std::any_of(candidates.begin(), candidates.end(),
                                 [](const Candidate& one) { return one.kind == Candidate::Kind::kRelayed; });
  if (!there && over && !relay_missed_) report(PathEvent::Kind::kNoRelay, now);
  relay_missed_ = !there && (over || relay_missed_);
}

// ------------------------------------------------------------------------------------------------------- datagrams

void Path::received(Attempt& attempt, std::span<const std::uint8_t> datagram) {
  const auto now = Clock::now();
  if (Heartbeat::is_beat(datagram)) {
    if (const auto answer = attempt.beat.hear(datagram, now)) (void)attempt.agent->send(*answer);
    if (&attempt == attempt_.get()) setup_.wake();
    return;
  }
  if (&attempt == attempt_.get() && !attempt.spoke) {
    attempt.spoke = true;
    setup_.wake();
  }
  (void)to_link_.send(datagram, {});
}

void Path::read_link() {
  std::array<std::uint8_t, 2048> bytes;
  SocketAddress from;
  for (int i = 0; i < kMostRead; ++i) {
    const auto arrival = to_link_.receive(bytes, from);
    if (!arrival) return;
    if (arrival->size == 0 || arrival->size > bytes.size()) continue;
    const auto datagram = std::span(bytes).first(arrival->size);
    if (current_) {
      (void)current_->agent->send(datagram);
    } else if (datagram[0] == kHandshakeRecord) {
      // Sent as soon as there is a path, so that the handshake need not wait to be repeated. Nothing else is kept: a
      // command that waited is none.
      if (held_.size() == kMostHeld) held_.erase(held_.begin());
      held_.emplace_back(datagram.begin(), datagram.end());
    }
  }
}

void Path::send_beats(Attempt& attempt, Clock::time_point now) {
  if (!attempt.agent->pair()) return;
  if (const auto question = attempt.beat.question(now, &attempt == current_.get()))
    (void)attempt.agent->send(*question);
}

// --------------------------------------------------------------------------------------------------------- judgement

void Path::tend(Clock::time_point now) {
  if (previous_ && now - switched_at_ > kLinger) previous_.reset();
  if (attempt_) judge_attempt(now);
  if (current_) judge_current(now);
  if (operates())
    begin_where_needed(now);
  else
    ask_for_attempt(now);
  for (Attempt* one : {attempt_.get(), current_.get()}) {
    if (one == nullptr) continue;
    if (one->session == sessions_) tell_candidates(*one, now);
    send_beats(*one, now);
  }
  report_pair(now);
}

/// Operator's side: it carries both ways. Machine's side: the operator's side uses it.
bool Path::attempt_works() const {
  if (!attempt_->agent->pair()) return false;
  if (operates()) return attempt_->beat.answered_at().has_value();
  return attempt_->spoke || attempt_->beat.far_end_uses();
}

void Path::judge_attempt(Clock::time_point now) {
  if (attempt_works()) {
    const bool must = !current_ || lost_ || !operates() || current_->session != sessions_;
    const bool settled = now - attempt_->begun > 2 * kPairsSettle;
    const auto kind_now = current_ ? current_->agent->pair() : std::nullopt;
    const auto kind_new = attempt_->agent->pair();
    const bool worse = kind_now && kind_new && kind_new->kind > kind_now->kind;
    if (must || (settled && !worse)) return use_attempt(now);
  }
  const bool outdated = operates() && changed_at_ > attempt_->begun;
  if (!attempt_->agent->failed() && now - attempt_->begun <= (outdated ? kOutdatedLasts : kAttemptLasts)) return;
  attempt_.reset();
  if (!operates() || outdated) return;  // outdated: the next begins at once
  begin_at_ = now + back_off_;
  back_off_ = std::min(2 * back_off_, kLongestBackOff);
  wanted_ = false;
  if (!carries()) report(PathEvent::Kind::kFailed, now);
}

void Path::use_attempt(Clock::time_point now) {
  previous_ = std::move(current_);
  current_ = std::move(attempt_);
  switched_at_ = now;
  lost_ = false;
  wanted_ = changed_at_ > current_->begun;
  back_off_ = kFirstBackOff;
  improve_at_ = now + improve_after_;
  seen_.reset();
  current_->beat.hurry();  // tells the machine's side which one is in use
  for (const Bytes& datagram : held_) (void)current_->agent->send(datagram);
  held_.clear();
}

void Path::judge_current(Clock::time_point now) {
  if (const auto took = current_->beat.take_round_trip()) {
    round_trip_ = *took;
    round_trips_.add(std::chrono::duration_cast<Duration>(*took));
  }
  const auto last = operates() ? current_->beat.answered_at() : current_->beat.heard_at();
  const bool silent = now - last.value_or(switched_at_) > kLostAfter;
  if (silent == lost_) return;
  lost_ = silent;
  report(lost_ ? PathEvent::Kind::kLost : PathEvent::Kind::kBack, now);
  if (lost_) begin_at_ = now;
}

/// Operator's side.
void Path::begin_where_needed(Clock::time_point now) {
  if (!carries() && now - hello_at_ > kHelloEvery) {
    hello_at_ = now;
    say({});
  }
  if (attempt_ || !knows_far_end() || now < begin_at_) return;
  const auto pair = current_ && !lost_ ? current_->agent->pair() : std::nullopt;
  const bool improve = pair && pair->kind == PathKind::kRelayed && now >= improve_at_;
  if (current_ && !lost_ && !wanted_ && !improve) return;
  const bool direct_only = improve && !wanted_;
  if (improve) {
    improve_after_ = std::min(2 * improve_after_, kLongestImprove);
    improve_at_ = now + improve_after_;
  }
  begin(++attempts_, direct_only, now);
}

/// Not each that is better than the one before it within a moment.
void Path::report_pair(Clock::time_point now) {
  const auto pair = current_ ? current_->agent->pair() : std::nullopt;
  if (!pair) return;
  if (seen_ != pair) {
    seen_ = pair;
    seen_at_ = now;
  }
  if (now - seen_at_ < kPairsSettle || reported_ == pair || round_trip_.count() == 0) return;
  reported_ = pair;
  report(PathEvent::Kind::kInUse, now);
}

}  // namespace knuckle::ice
