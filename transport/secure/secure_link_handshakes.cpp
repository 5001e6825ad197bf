// SecureLink's handshakes: all of this is called by its own thread, which may allocate and wait.
#include <netinet/in.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "transport/other_version.h"
#include "transport/secure/dtls_session.h"
#include "transport/secure/secure_link.h"

namespace knuckle::secure {
namespace {

using namespace std::chrono_literals;

// At a time; of ends that have shown that their address is theirs. Beyond them the oldest that does not go on makes
// room, so that nobody keeps others out by handshakes that stall.
constexpr std::size_t kMostHandshakes = 16, kMostOfOneHost = 4;
constexpr int kHellosPer100ms = 1000;  // more are dropped unread: nobody honest sends as many
constexpr auto kPollTime = 20ms, kPollTimeWithObservers = 5ms;
constexpr auto kTryAgain = 1000ms;                                   // after a refusal
constexpr auto kNextAddress = 250ms;                                 // of a name that has several (RFC 8305, 5)
constexpr auto kTimeForCertificate = 250ms, kTimeForProof = 1000ms;  // of a handshake, where others want its place
constexpr auto kLookAtPeers = 1000ms;
constexpr auto kNewCookies = 60s;
constexpr int kProposals = 4;  // of what nobody confirms
constexpr auto kSayPlain = 500ms;
constexpr auto kSayLastAgain = 100ms;  // sooner nobody honest misses it
constexpr int kMostRefusals = 64;

/// Of IPv6, one host has a network of 64 bits.
SocketAddress host_of(SocketAddress address) noexcept {
  reinterpret_cast<sockaddr_in&>(address.bytes).sin_port = 0;  // at the same place for both families
  if (address.bytes.ss_family == AF_INET6) {
    auto& six = reinterpret_cast<sockaddr_in6&>(address.bytes).sin6_addr;
    if (!IN6_IS_ADDR_V4MAPPED(&six)) std::memset(six.s6_addr + 8, 0, 8);
  }
  return address;
}

struct HeldOut final : DtlsSession::Out {
  std::vector<std::vector<std::uint8_t>> datagrams;
  void put(std::span<const std::uint8_t> bytes) override { datagrams.emplace_back(bytes.begin(), bytes.end()); }
};

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
    if (role_ == Role::kMachine) continue;
    hear_refusals();
    start_where_needed(now);
    if (silent()) continue;
    const std::lock_guard lock(problem_mutex_);
    problem_.clear();
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
  if (SocketAddress address; moves_.take(address) && holder_) holder_->address = address;
  if (RefusedBy refused; refused_by_.take(refused)) {
    try_at_ = now + kTryAgain;
    holder_.reset();
    const std::string name(refused.name.view());
    const std::lock_guard lock(problem_mutex_);
    problem_ = refused.refusal == Refusal::kBusy && !name.empty() ? name + " has control there, and was asked for it"
                                                                  : text(refused.refusal);
  }
  std::erase_if(asked_, [&](const auto& asked) { return now - asked.second > timing_.ask_again; });
  if (now - cookies_at_ >= kNewCookies) {
    cookies_at_ = now;
    context_.renew_cookies();
  }
  if (now - peers_at_ < kLookAtPeers) return;
  peers_at_ = now;
  if (std::optional<Peers> peers = access_.newer_peers ? access_.newer_peers() : std::nullopt)
    context_.set_peers(std::move(*peers));
  check_admitted();
}

/// Who was revoked meanwhile, has another role, or whose certificate has expired is cut off.
void SecureLink::check_admitted() {
  const Refusal refusal = holder_ ? context_.judge(holder_->certificate.get(), Purpose::kControl) : Refusal::kNone;
  if (refusal != Refusal::kNone) cut_off_holder(refusal);
  for (Observer& observer : observers_) {
    const Refusal why = context_.judge(observer.certificate.get(), Purpose::kObserve);
    if (why == Refusal::kNone) continue;
    LinkEvent event = event_of(LinkEvent::Kind::kCutOff, observer.address, observer.peer);
    event.refusal = why;
    put(event);
    observer.session.reset();
  }
  std::erase_if(observers_, [](const Observer& observer) { return !observer.session; });
}

void SecureLink::cut_off_holder(Refusal refusal) {
  LinkEvent event = event_of(LinkEvent::Kind::kCutOff, holder_->address, holder_->peer);
  event.refusal = refusal;
  put(event);
  // The offer first: the loop's thread, which reads the note, must not find it afterwards.
  delete offered_.exchange(nullptr, std::memory_order_acq_rel);
  cut_offs_.put(holder_->peer);
  holder_.reset();
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
    if (!arrival && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    if (!arrival) continue;
    if (arrival->size == 0 || arrival->size > bytes.size()) continue;
    hear(std::span<const std::uint8_t>(bytes).first(arrival->size), from, now);
  }
}

void SecureLink::hear(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now) {
  if (is_plain(bytes)) return hear_plain(from, now);
  const auto known = std::find_if(handshakes_.begin(), handshakes_.end(),
                                  [&](const Handshake& one) { return one.session && one.address == from; });
  if (known != handshakes_.end()) {
    // What ends it leaves when this end hears the new keys: the far end uses them as soon as it has heard it.
    HeldOut held;
    const auto progress = known->session->hear(bytes, held);
    const bool controls = known->session->purpose() == Purpose::kControl;
    if (!known->done) advance(*known, progress, now);
    for (const std::vector<std::uint8_t>& one : held.datagrams) (void)sockets_.unmarked.send(one, known->address);
    if (!known->session && controls) last_words_ = {known->address, std::move(held.datagrams), now};
    return;
  }
  if (role_ != Role::kMachine || hear_observer(bytes, from, now) || hear_again(bytes, from, now)) return;
  hear_stranger(bytes, from, now);
}

/// A hello: of an end that is new here, or of one that has begun anew.
void SecureLink::hear_stranger(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now) {
  if (!is_hello(bytes) || hellos_left_ == 0) return;
  --hellos_left_;
  if (!listening_) listening_ = std::make_unique<DtlsSession>(context_);
  HandshakeOut out(sockets_.unmarked, from);
  const auto yields = who_yields(from, now);
  if (!yields || !listening_->hear_hello(bytes, from, out)) return;
  if (*yields != handshakes_.end()) handshakes_.erase(*yields);
  Handshake& begun = handshakes_.emplace_back(Handshake{std::move(listening_), from, now});
  advance(begun, begun.session->start(out), now);
}

/// @return the handshake that makes room for one from there; the end where there is room. nullopt: each has had too
/// little time yet.
std::optional<std::vector<SecureLink::Handshake>::iterator> SecureLink::who_yields(const SocketAddress& from,
                                                                                   Clock::time_point now) {
  const auto of_host = [&](const Handshake& one) { return host_of(one.address) == host_of(from); };
  const auto of_this_host = std::count_if(handshakes_.begin(), handshakes_.end(), of_host);
  const bool host_full = static_cast<std::size_t>(of_this_host) >= kMostOfOneHost;
  if (!host_full && handshakes_.size() < kMostHandshakes) return handshakes_.end();
  const auto oldest = std::find_if(handshakes_.begin(), handshakes_.end(), [&](const Handshake& one) {
    // A certificate alone proves nothing: it travels in clear.
    const auto time_for_it = one.session && one.session->peer() ? kTimeForProof : kTimeForCertificate;
    return !one.done && now - one.since >= time_for_it && (!host_full || of_host(one));
  });
  if (oldest == handshakes_.end()) return std::nullopt;
  return oldest;
}

/// The far end of the offered session may not have heard our last words: then it says its own again. The session itself
/// is the loop's, which may take it at any time.
bool SecureLink::hear_again(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now) {
  if (is_hello(bytes) || !(from == last_words_.to) || offered_.load(std::memory_order_relaxed) == nullptr) return false;
  if (now - last_words_.said_at < kSayLastAgain) return true;
  last_words_.said_at = now;
  for (const std::vector<std::uint8_t>& one : last_words_.datagrams) (void)sockets_.unmarked.send(one, from);
  return true;
}

/// A far end that runs with --insecure. All that comes of it are words: here, and there.
void SecureLink::hear_plain(const SocketAddress& from, Clock::time_point now) {
  if (role_ == Role::kOperator) return suspect(from, Refusal::kPlain);
  if (now - plain_at_ < kSayPlain) return;
  plain_at_ = now;
  (void)sockets_.unmarked.send(kEncryptedHere, from);
  LinkEvent event = event_of(LinkEvent::Kind::kRefused, from, {});
  event.refusal = Refusal::kPlain;
  put(event);
}

/// Not during a session: each would fail a call of the loop, and anybody can send them. The kernel tells either socket.
void SecureLink::hear_refusals_of_attempts(bool on) {
  sockets_.marked.hear_refusals(on);
  sockets_.unmarked.hear_refusals(on);
}

void SecureLink::hear_refusals() {
  for (const UdpSocket* socket : {&sockets_.marked, &sockets_.unmarked}) {
    for (int i = 0; i < kMostRefusals; ++i) {
      const auto address = socket->next_refusal();
      if (!address) break;
      suspect(*address, Refusal::kPortClosed);
    }
  }
}

/// Why a handshake gets no answer, as somebody says who is not proven: it goes on all the same.
void SecureLink::suspect(const SocketAddress& address, Refusal refusal) {
  for (Handshake& one : handshakes_) {
    if (one.done || !(one.address == address)) continue;
    one.if_silent = refusal;
    tell_problem(address, refusal);
  }
}

void SecureLink::tell_problem(const SocketAddress& address, Refusal refusal) {
  const std::lock_guard lock(problem_mutex_);
  problem_ = knuckle::text(address) + ": " + text(refusal);
}

void SecureLink::advance(Handshake& handshake, DtlsSession::Progress progress, Clock::time_point now) {
  if (progress == DtlsSession::Progress::kUnderWay) return;
  handshake.done = true;
  if (progress == DtlsSession::Progress::kFailed) return fail(handshake, handshake.session->refusal());
  // Its certificate was judged when it came, which may be seconds ago.
  const Refusal refusal = context_.judge(handshake.session->peer_certificate().get(), handshake.session->purpose());
  if (refusal != Refusal::kNone) return fail(handshake, refusal);
  if (role_ == Role::kOperator) return offer(handshake, now);
  switch (handshake.session->purpose()) {
    case Purpose::kControl:
      return decide_control(handshake, now);
    case Purpose::kObserve:
      return admit_observer(handshake, now);
    case Purpose::kTry:
      put(event_of(LinkEvent::Kind::kTried, handshake.address, *handshake.session->peer()));
      return answer(handshake, held_against(handshake, now) != nullptr ? Refusal::kBusy : Refusal::kNone);
    case Purpose::kPair:
      return;  // was refused
  }
}

/// @return who has control, or was granted it, where that is not this one; nullptr: it may have it.
const Fingerprint* SecureLink::held_against(const Handshake& handshake, Clock::time_point now) const {
  const Fingerprint& peer = *handshake.session->peer();
  if (granted_to_) return *granted_to_ == peer ? nullptr : &*granted_to_;
  // Another program with the same key is another one, too; the same program keeps its port when it renews its keys.
  if (!holder_ || (holder_->peer == peer && holder_->address == handshake.address)) return nullptr;
  const bool present = !silent() || now - taken_at_ < timing_.silence;  // heard, or about to be
  return present ? &holder_->peer : nullptr;
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
  // One that the loop has not taken may itself have come after somebody else's.
  const std::unique_ptr<Offer> untaken(offered_.exchange(nullptr, std::memory_order_acq_rel));
  const bool renews =
      holder_ && holder_->peer == peer && holder_->address == handshake.address && (!untaken || untaken->renews);
  holder_ = Holder{peer, handshake.session->peer_certificate(), handshake.address};
  granted_to_.reset();
  made_at_ = now;
  if (!renews) taken_at_ = now;  // handshakes alone, of a program whose loop is silent, keep nothing
  // What another program seals is not even read from now on: the loop may learn of the change only later. What comes by
  // the loop's own keys is, also where the far end has never used those that were offered meanwhile.
  tags_ = {tag, !renews ? tag : untaken ? tags_[1] : tags_[0]};
  sockets_.marked.hear_only_beginning_with(tags_);
  auto offer =
      std::make_unique<Offer>(Offer{std::move(handshake.session), handshake.address, peer, name_of(peer), renews});
  offered_tag_.store(number_of(tag), std::memory_order_relaxed);
  delete offered_.exchange(offer.release(), std::memory_order_acq_rel);
  if (role_ == Role::kOperator) {
    hear_refusals_of_attempts(false);
    to_try_.clear();  // other addresses of the same far end
    for (Handshake& other : handshakes_) other.done = true;
  }
}

/// To who is not let in, a few times, since nobody confirms it.
void SecureLink::answer(Handshake& handshake, Refusal refusal) {
  handshake.answer = refusal;
  ++handshake.answers;
  handshake.answered_at = Clock::now();
  const Fingerprint* holder = granted_to_ ? &*granted_to_ : holder_ ? &holder_->peer : nullptr;
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
      if (now - one.answered_at >= kPollTime) answer(one, one.answer);
      continue;
    }
    if (one.done) continue;
    if (now - one.since > timing_.answer) {
      one.done = true;
      fail(one, one.if_silent);
      continue;
    }
    HandshakeOut out(sockets_.unmarked, one.address);
    advance(one, one.session->tend(out), now);
  }
  std::erase_if(handshakes_,
                [](const Handshake& one) { return one.done && (one.answers == 0 || one.answers >= kProposals); });
}

void SecureLink::fail(const Handshake& handshake, Refusal refusal) {
  const std::optional<Fingerprint>& peer = handshake.session->peer();
  LinkEvent event = event_of(LinkEvent::Kind::kRefused, handshake.address, peer.value_or(Fingerprint{}));
  event.refusal = refusal;
  put(event);
  // Its keys cannot be renewed any more: then it is not to stay on its old ones, either.
  if (holder_ && peer == holder_->peer && (refusal == Refusal::kExpiredPeer || refusal == Refusal::kRevokedPeer))
    cut_off_holder(refusal);
  if (role_ == Role::kMachine) return;
  try_at_ = Clock::now() + kTryAgain;
  tell_problem(handshake.address, refusal);
}

PeerName SecureLink::name_of(const Fingerprint& peer) const noexcept {
  const Peer* known = context_.find(peer);
  return known != nullptr ? PeerName(known->name) : PeerName();
}

LinkEvent SecureLink::event_of(LinkEvent::Kind kind, const SocketAddress& address, const Fingerprint& peer) const {
  return {kind, address, peer, name_of(peer), Refusal::kNone, {}};
}

/// Operator's side: one address of the far end after the other, without waiting long; whichever answers first is it.
void SecureLink::start_where_needed(Clock::time_point now) {
  if (released_.load(std::memory_order_relaxed)) {
    handshakes_.clear();
    to_try_.clear();
    holder_.reset();
    const std::lock_guard lock(problem_mutex_);
    problem_.clear();
    return;
  }
  if (handshakes_.empty() && to_try_.empty() && now >= try_at_) {
    const bool fresh = now - made_at_ < timing_.silence;
    if (!holder_ || (silent() && !fresh)) {
      to_try_.assign(targets_.rbegin(), targets_.rend());
      hear_refusals_of_attempts(true);
    } else if (now - made_at_ >= timing_.renew_keys) {
      to_try_ = {holder_->address};
    }
  }
  if (to_try_.empty() || (!handshakes_.empty() && now - begun_at_ < kNextAddress)) return;
  try_at_ = now + kTryAgain;
  begun_at_ = now;
  Handshake& begun = handshakes_.emplace_back(Handshake{std::make_unique<DtlsSession>(context_), to_try_.back(), now});
  to_try_.pop_back();
  HandshakeOut out(sockets_.unmarked, begun.address);
  advance(begun, begun.session->start(out), now);
}

}  // namespace knuckle::secure
