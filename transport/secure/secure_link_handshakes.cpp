// SecureLink's handshakes: all of this is called by its own thread, which may allocate and wait.
#include <netinet/in.h>
#include <poll.h>

#include <algorithm>
#include <cstring>

#include "transport/secure/handshake_out.h"
#include "transport/secure/secure_link.h"

namespace knuckle::secure {
namespace {

using namespace std::chrono_literals;

// At a time; of ends that have shown that their address is theirs. One host alone cannot keep others out.
constexpr std::size_t kMostHandshakes = 16, kMostOfOneHost = 4;
constexpr int kHellosPer100ms = 1000;  // more are dropped unread: nobody honest sends as many
constexpr auto kPollTime = 20ms, kPollTimeWithObservers = 5ms;
constexpr auto kTryAgain = 1000ms;  // after a refusal
constexpr auto kLookAtPeers = 1000ms;
constexpr int kRepeats = 4;  // of what nobody confirms
constexpr std::size_t kMostReceived = 2048;

std::uint64_t number_of(const Tag& tag) noexcept {
  std::uint64_t number = 0;
  std::memcpy(&number, tag.data(), sizeof number);
  return number;
}

bool same_host(SocketAddress one, SocketAddress other) noexcept {
  // The port is at the same place for both families.
  reinterpret_cast<sockaddr_in&>(one.bytes).sin_port = reinterpret_cast<sockaddr_in&>(other.bytes).sin_port = 0;
  return one == other;
}

/// DTLS 1.2 record of epoch 0 with a ClientHello.
bool is_hello(std::span<const std::uint8_t> bytes) noexcept {
  constexpr std::size_t kTypeOfMessage = 13;
  constexpr std::uint8_t kHandshakeRecord = 22, kClientHello = 1;
  return bytes.size() > kTypeOfMessage && bytes[0] == kHandshakeRecord && bytes[3] == 0 && bytes[4] == 0 &&
         bytes[kTypeOfMessage] == kClientHello;
}

}  // namespace

void SecureLink::run() {
  while (!ending_.load(std::memory_order_relaxed)) {
    const auto patience = observers_.empty() ? kPollTime : kPollTimeWithObservers;
    pollfd descriptor{sockets_.unmarked.descriptor(), POLLIN, 0};
    (void)::poll(&descriptor, 1, static_cast<int>(patience.count()));
    const auto now = Clock::now();
    free_retired();
    take_notes(now);
    read_handshakes(now);
    tend(now);
    serve_observers(now);
    if (role_ == Role::kOperator) start_where_needed(now);
  }
}

void SecureLink::free_retired() {
  Offer* retired = nullptr;
  while (retired_.pop(retired)) delete retired;
}

/// What the loop's thread has left here, and whom the owner of this end admits by now.
void SecureLink::take_notes(Clock::time_point now) {
  Fingerprint to;
  if (grants_.take(to)) {
    granted_to_ = to;
    granted_at_ = now;
  }
  if (granted_to_ && now - granted_at_ > timing_.grant) granted_to_.reset();
  moves_.take(holder_address_);
  if (RefusedBy refused; refused_by_.take(refused)) {
    try_at_ = now + kTryAgain;
    holder_.reset();
    const std::string name(refused.name.view());
    const std::lock_guard lock(problem_mutex_);
    problem_ = refused.refusal == Refusal::kBusy && !name.empty() ? name + " has control there, and was asked for it"
                                                                  : text(refused.refusal);
  }
  std::erase_if(asked_, [&](const auto& asked) { return now - asked.second > timing_.ask_again; });
  if (access_.newer_peers && now - peers_at_ >= kLookAtPeers) {
    peers_at_ = now;
    if (std::optional<Peers> peers = access_.newer_peers()) apply(std::move(*peers));
  }
}

/// Revoked, or with another role: cut off at once.
void SecureLink::apply(Peers peers) {
  context_.set_peers(std::move(peers));
  const Refusal refusal = holder_ ? admits(*holder_, Purpose::kControl) : Refusal::kNone;
  if (refusal != Refusal::kNone) cut_off_holder(refusal);
  for (Observer& observer : observers_) {
    const Refusal why = admits(observer.peer, Purpose::kObserve);
    if (why == Refusal::kNone) continue;
    LinkEvent event = event_of(LinkEvent::Kind::kCutOff, observer.address, observer.peer);
    event.refusal = why;
    put(event);
    observer.session.reset();
  }
  std::erase_if(observers_, [](const Observer& observer) { return !observer.session; });
}

void SecureLink::cut_off_holder(Refusal refusal) {
  LinkEvent event = event_of(LinkEvent::Kind::kCutOff, holder_address_, *holder_);
  event.refusal = refusal;
  put(event);
  cut_offs_.put(*holder_);
  delete offered_.exchange(nullptr, std::memory_order_acq_rel);
  holder_.reset();
}

Refusal SecureLink::admits(const Fingerprint& fingerprint, Purpose purpose) const noexcept {
  const Peer* peer = context_.find(fingerprint);
  if (peer == nullptr) return Refusal::kUnknownPeer;
  if (peer->revoked) return Refusal::kRevokedPeer;
  const bool leads = role_ == Role::kMachine && purpose == Purpose::kControl;
  return leads && peer->observer ? Refusal::kObserver : Refusal::kNone;
}

void SecureLink::read_handshakes(Clock::time_point now) {
  if (now - hellos_at_ >= 100ms) {
    hellos_at_ = now;
    hellos_left_ = kHellosPer100ms;
  }
  std::array<std::uint8_t, kMostReceived> bytes;
  for (int i = 0; i < 2 * kHellosPer100ms; ++i) {
    SocketAddress from;
    const auto arrival = sockets_.unmarked.receive(bytes, from);
    if (!arrival) return;
    if (arrival->size == 0 || arrival->size > bytes.size()) continue;
    hear(std::span<const std::uint8_t>(bytes).first(arrival->size), from, now);
  }
}

void SecureLink::hear(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now) {
  const auto known = std::find_if(handshakes_.begin(), handshakes_.end(),
                                  [&](const Handshake& one) { return one.session && one.address == from; });
  if (known != handshakes_.end()) {
    HandshakeOut out(sockets_.unmarked, known->address);
    const auto progress = known->session->hear(bytes, out);
    if (!known->done) advance(*known, progress, now);
    return;
  }
  if (role_ != Role::kMachine || hear_observer(bytes, from, now) || hear_again(bytes, from)) return;
  hear_stranger(bytes, from, now);
}

/// A hello: of an end that is new here, or of one that has begun anew.
void SecureLink::hear_stranger(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now) {
  if (!is_hello(bytes) || hellos_left_ == 0 || handshakes_.size() >= kMostHandshakes) return;
  const auto of_host = std::count_if(handshakes_.begin(), handshakes_.end(),
                                     [&](const Handshake& one) { return same_host(one.address, from); });
  if (static_cast<std::size_t>(of_host) >= kMostOfOneHost) return;
  --hellos_left_;
  if (!listening_) listening_ = std::make_unique<DtlsSession>(context_);
  HandshakeOut out(sockets_.unmarked, from);
  if (!listening_->hear_hello(bytes, from, out)) return;
  Handshake& begun = handshakes_.emplace_back(Handshake{std::move(listening_), from, now});
  advance(begun, begun.session->start(out), now);
}

/// The far end of the offered session may not have heard our last words: then it says its own again.
bool SecureLink::hear_again(std::span<const std::uint8_t> bytes, const SocketAddress& from) {
  Offer* offer = is_hello(bytes) ? nullptr : offered_.exchange(nullptr, std::memory_order_acquire);
  if (offer == nullptr) return false;
  const bool same = offer->address == from;
  if (same) {
    HandshakeOut out(sockets_.unmarked, offer->address);
    (void)offer->session->hear(bytes, out);
  }
  offered_.store(offer, std::memory_order_release);
  return same;
}

void SecureLink::advance(Handshake& handshake, DtlsSession::Progress progress, Clock::time_point now) {
  if (progress == DtlsSession::Progress::kUnderWay) return;
  handshake.done = true;
  if (progress == DtlsSession::Progress::kFailed) return fail(handshake, handshake.session->refusal());
  if (role_ == Role::kOperator) return offer(handshake, now);
  switch (handshake.session->purpose()) {
    case Purpose::kControl:
      return decide_control(handshake, now);
    case Purpose::kObserve:
      return admit_observer(handshake, now);
    case Purpose::kTry:
      put(event_of(LinkEvent::Kind::kTried, handshake.address, *handshake.session->peer()));
      return answer(handshake, held_against(handshake, now) != nullptr ? Refusal::kBusy : Refusal::kNone);
  }
}

/// @return who has control, or was granted it, where that is not this one; nullptr: it may have it.
const Fingerprint* SecureLink::held_against(const Handshake& handshake, Clock::time_point now) const {
  const Fingerprint& peer = *handshake.session->peer();
  if (granted_to_) return *granted_to_ == peer ? nullptr : &*granted_to_;
  // Another program with the same key is another one, too; the same program keeps its port when it renews its keys.
  if (!holder_ || (*holder_ == peer && holder_address_ == handshake.address)) return nullptr;
  const bool present = !silent() || now - made_at_ < timing_.silence;  // heard, or about to be
  return present ? &*holder_ : nullptr;
}

void SecureLink::decide_control(Handshake& handshake, Clock::time_point now) {
  if (held_against(handshake, now) == nullptr) return offer(handshake, now);
  LinkEvent event = event_of(LinkEvent::Kind::kRefused, handshake.address, *handshake.session->peer());
  event.refusal = Refusal::kBusy;
  put(event);
  ask_for(handshake, now);
  answer(handshake, Refusal::kBusy);
}

/// Who has control is told who asks for it, now and then.
void SecureLink::ask_for(const Handshake& handshake, Clock::time_point now) {
  const Fingerprint& peer = *handshake.session->peer();
  const bool lately = std::any_of(asked_.begin(), asked_.end(), [&](const auto& one) { return one.first == peer; });
  if (lately || granted_to_) return;
  asked_.emplace_back(peer, now);
  askers_.put({peer, name_of(peer)});
}

void SecureLink::offer(Handshake& handshake, Clock::time_point now) {
  free_retired();
  const Fingerprint peer = *handshake.session->peer();
  const Tag tag = handshake.session->receive_tag();
  holder_ = peer;
  holder_address_ = handshake.address;
  granted_to_.reset();
  made_at_ = now;
  tags_ = {tag, tags_[0]};
  sockets_.marked.hear_only_beginning_with(tags_);
  auto offer = std::make_unique<Offer>(Offer{std::move(handshake.session), handshake.address, peer, name_of(peer)});
  offered_tag_.store(number_of(tag), std::memory_order_relaxed);
  delete offered_.exchange(offer.release(), std::memory_order_acq_rel);
  const std::lock_guard lock(problem_mutex_);
  problem_.clear();
}

/// To who is not let in, a few times, since nobody confirms it.
void SecureLink::answer(Handshake& handshake, Refusal refusal) {
  handshake.answer = refusal;
  ++handshake.answers;
  const Fingerprint* holder = granted_to_ ? &*granted_to_ : holder_ ? &*holder_ : nullptr;
  const PeerName who = holder != nullptr && refusal == Refusal::kBusy ? name_of(*holder) : PeerName();
  const std::string_view name = who.view();
  std::array<std::uint8_t, 1 + kMostNameLength> text{static_cast<std::uint8_t>(refusal)};
  std::copy(name.begin(), name.end(), text.begin() + 1);
  Sealed sealed;
  if (handshake.session->seal(Inner::kAnswer, std::span(text).first(1 + name.size()), sealed))
    (void)sockets_.marked.send(sealed.view(), handshake.address);
}

void SecureLink::tend(Clock::time_point now) {
  for (Handshake& one : handshakes_) {
    if (one.answers > 0) {
      answer(one, one.answer);
      continue;
    }
    if (one.done) continue;
    if (now - one.since > timing_.answer) {
      one.done = true;
      fail(one, Refusal::kSilence);
      continue;
    }
    HandshakeOut out(sockets_.unmarked, one.address);
    advance(one, one.session->tend(out), now);
  }
  std::erase_if(handshakes_,
                [](const Handshake& one) { return one.done && (one.answers == 0 || one.answers >= kRepeats); });
}

void SecureLink::fail(const Handshake& handshake, Refusal refusal) {
  const std::optional<Fingerprint>& peer = handshake.session->peer();
  LinkEvent event = event_of(LinkEvent::Kind::kRefused, handshake.address, peer.value_or(Fingerprint{}));
  event.refusal = refusal;
  put(event);
  // Its keys cannot be renewed any more: then it is not to stay on its old ones, either.
  if (holder_ && peer == holder_ && (refusal == Refusal::kExpiredPeer || refusal == Refusal::kRevokedPeer))
    cut_off_holder(refusal);
  if (role_ == Role::kMachine) return;
  try_at_ = Clock::now() + kTryAgain;
  const std::lock_guard lock(problem_mutex_);
  problem_ = knuckle::text(handshake.address) + ": " + text(refusal);
}

PeerName SecureLink::name_of(const Fingerprint& peer) const noexcept {
  const Peer* known = context_.find(peer);
  return known != nullptr ? PeerName(known->name) : PeerName();
}

LinkEvent SecureLink::event_of(LinkEvent::Kind kind, const SocketAddress& address, const Fingerprint& peer) const {
  return {kind, address, peer, name_of(peer), Refusal::kNone, {}};
}

/// Operator's side: all addresses of the far end at once; whichever answers first is it.
void SecureLink::start_where_needed(Clock::time_point now) {
  if (released_.load(std::memory_order_relaxed)) {
    handshakes_.clear();
    holder_.reset();
    return;
  }
  const bool done = std::any_of(handshakes_.begin(), handshakes_.end(), [](const Handshake& one) { return one.done; });
  if (done) handshakes_.clear();
  const bool fresh = now - made_at_ < timing_.silence;
  const bool gone = !holder_ || (silent() && !fresh);
  const bool old = holder_ && now - made_at_ >= timing_.renew_keys;
  if (!handshakes_.empty() || now < try_at_ || (!gone && !old)) return;
  try_at_ = now + kTryAgain;
  for (const SocketAddress& target : targets_) {
    Handshake& begun = handshakes_.emplace_back(Handshake{std::make_unique<DtlsSession>(context_), target, now});
    HandshakeOut out(sockets_.unmarked, begun.address);
    advance(begun, begun.session->start(out), now);
  }
}

}  // namespace knuckle::secure
