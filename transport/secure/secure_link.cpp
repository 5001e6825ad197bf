#include "transport/secure/secure_link.h"

#include <netinet/in.h>
#include <poll.h>

#include <algorithm>
#include <cstring>
#include <iterator>

#include "core/error.h"

namespace knuckle::secure {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMostHandshakes = 8;  // at a time; of ends that have shown that their address is theirs
constexpr int kHellosPer100ms = 200;        // more are dropped unread: nobody honest sends as many
constexpr auto kPollTime = 20ms;
constexpr auto kTryAgain = 1000ms;  // after a refusal
constexpr auto kAskAgain = 50ms;    // a new address, whether it is the far end's
constexpr int kBusyRepeats = 4;
constexpr std::size_t kMostReceived = 2048;
constexpr int kMostSkipped = 32;

std::uint64_t number_of(const Tag& tag) noexcept {
  std::uint64_t number = 0;
  std::memcpy(&number, tag.data(), sizeof number);
  return number;
}

/// Sends what a handshake says to one address.
class To final : public DtlsSession::Out {
 public:
  To(const UdpSocket& socket, const SocketAddress& address) : socket_(socket), address_(address) {}
  void put(std::span<const std::uint8_t> bytes) override { (void)socket_.send(bytes, address_); }

 private:
  const UdpSocket& socket_;
  const SocketAddress& address_;
};

SocketAddress mapped(const SocketAddress& address) {
  if (address.bytes.ss_family != AF_INET) return address;
  const auto& four = reinterpret_cast<const sockaddr_in&>(address.bytes);
  SocketAddress result;
  auto& six = reinterpret_cast<sockaddr_in6&>(result.bytes);
  six.sin6_family = AF_INET6;
  six.sin6_port = four.sin_port;
  six.sin6_addr.s6_addr[10] = six.sin6_addr.s6_addr[11] = 0xFF;
  std::memcpy(six.sin6_addr.s6_addr + 12, &four.sin_addr, sizeof four.sin_addr);
  result.size = sizeof(sockaddr_in6);
  return result;
}

std::vector<SocketAddress> look_up_target(const std::string& address) {
  std::vector<SocketAddress> targets = look_up(address);
  if (targets.front().port() == 0)
    throw InputError("link: " + address + ": port 0 cannot be used; give the port that the other side listens on");
  if (targets.front().is_any()) throw InputError("link: " + address + ": is no single computer's address");
  return targets;
}

}  // namespace

std::string text(const LinkEvent& event) {
  const std::string name(event.name.data());
  const std::string at = " at " + text(event.address);
  const std::string who =
      event.peer == Fingerprint{} ? "" : (name.empty() ? "" : name + " ") + "(" + short_text(event.peer) + ")";
  switch (event.kind) {
    case LinkEvent::Kind::kConnected:
      return "connected: " + who + at;
    case LinkEvent::Kind::kRenewed:
      return "connected anew: " + who + at;
    case LinkEvent::Kind::kMoved:
      return "moved: " + who + ", now" + at;
    case LinkEvent::Kind::kClosed:
      return "closed by " + who + at;
    case LinkEvent::Kind::kRefused:
      break;
  }
  if (event.refusal == Refusal::kBusy && who.empty())
    return "refused" + at + ": " + (name.empty() ? "somebody else" : name) + " has control there";
  return "refused" + (who.empty() ? at : ": " + who + at) + ": " + text(event.refusal);
}

std::unique_ptr<SecureLink> SecureLink::listen(const std::string& address, const Identity& identity, Peers peers,
                                               const SecureLinkTiming& timing) {
  return std::unique_ptr<SecureLink>(new SecureLink(open_socket_pair(address, parse_address(address), kTagMark),
                                                    identity, std::move(peers), Role::kMachine, {}, timing));
}

std::unique_ptr<SecureLink> SecureLink::connect(const std::string& address, const Identity& identity, Peers peers,
                                                const SecureLinkTiming& timing) {
  std::vector<SocketAddress> targets = look_up_target(address);
  const bool six = std::any_of(targets.begin(), targets.end(),
                               [](const SocketAddress& one) { return one.bytes.ss_family == AF_INET6; });
  if (six) std::transform(targets.begin(), targets.end(), targets.begin(), mapped);
  const std::string here = six ? "[::]:0" : "0.0.0.0:0";
  return std::unique_ptr<SecureLink>(new SecureLink(open_socket_pair(here, parse_address(here), kTagMark), identity,
                                                    std::move(peers), Role::kOperator, std::move(targets), timing));
}

SecureLink::SecureLink(SocketPair sockets, const Identity& identity, Peers peers, Role role,
                       std::vector<SocketAddress> targets, const SecureLinkTiming& timing)
    : sockets_(std::move(sockets)),
      context_(identity, std::move(peers), role),
      role_(role),
      targets_(std::move(targets)),
      timing_(timing) {
  sockets_.marked.hear_only_beginning_with({});
  thread_ = std::thread([this] { run(); });
}

SecureLink::~SecureLink() {
  ending_.store(true, std::memory_order_relaxed);
  thread_.join();
  delete offered_.exchange(nullptr);
  Offer* retired = nullptr;
  while (retired_.pop(retired)) delete retired;
}

std::uint16_t SecureLink::port() const noexcept {
  return local_address(sockets_.marked.descriptor()).port();
}

std::string SecureLink::problem() const {
  const std::lock_guard lock(problem_mutex_);
  return problem_;
}

// -------------------------------------------------------------------------------------------------- the loop's thread

bool SecureLink::silent() const noexcept {
  const auto heard = Clock::time_point(Clock::duration(heard_at_.load(std::memory_order_relaxed)));
  return Clock::now() - heard >= timing_.silence;
}

void SecureLink::take_offer() noexcept {
  if (offered_.load(std::memory_order_relaxed) == nullptr) return;
  Offer* offer = offered_.exchange(nullptr, std::memory_order_acquire);
  if (offer == nullptr) return;
  if (previous_) retired_.push(previous_.release());
  const bool renewed = talks_ && current_ && current_->peer == offer->peer;
  previous_ = std::move(current_);
  current_.reset(offer);
  talks_ = true;
  move_ = {};
  report(renewed ? LinkEvent::Kind::kRenewed : LinkEvent::Kind::kConnected);
}

bool SecureLink::send(std::span<const std::uint8_t> bytes) noexcept {
  if (role_ == Role::kOperator) take_offer();
  if (!talks_ || (role_ == Role::kMachine && silent())) return false;
  Sealed sealed;
  if (!current_->session->seal(Inner::kMessage, bytes, sealed)) return false;
  return sockets_.marked.send(sealed.view(), current_->address) == 0;
}

void SecureLink::send_inner(Inner kind, std::span<const std::uint8_t> bytes, const SocketAddress& to) noexcept {
  Sealed sealed;
  if (current_->session->seal(kind, bytes, sealed)) (void)sockets_.marked.send(sealed.view(), to);
}

bool SecureLink::receive(Datagram& datagram) noexcept {
  if (role_ == Role::kOperator) take_offer();
  std::array<std::uint8_t, kMostReceived> bytes;
  for (int i = 0; i < kMostSkipped; ++i) {
    SocketAddress from;
    const auto arrival = sockets_.marked.receive(bytes, from);
    if (!arrival) return false;
    if (arrival->size <= kTagSize || arrival->size > bytes.size()) continue;
    const std::span received = std::span<const std::uint8_t>(bytes).first(arrival->size);
    Tag tag;
    std::copy_n(received.begin(), kTagSize, tag.begin());
    // Whoever seals with the offered session has finished its handshake.
    if (role_ == Role::kMachine && number_of(tag) == offered_tag_.load(std::memory_order_relaxed)) take_offer();
    if (!open(received, from, datagram)) continue;
    datagram.waited = arrival->waited;
    return true;
  }
  return false;
}

bool SecureLink::open(std::span<const std::uint8_t> bytes, const SocketAddress& from, Datagram& datagram) noexcept {
  const bool is_current = current_ && current_->session->mine(bytes);
  Offer* of = is_current ? current_.get() : previous_.get();
  if (of == nullptr || (!is_current && !of->session->mine(bytes))) return false;
  const auto opened = of->session->open(bytes, datagram);
  if (!opened) {
    if (!is_current || !talks_ || !of->session->closed()) return false;
    talks_ = false;
    heard_at_.store(0, std::memory_order_relaxed);
    report(LinkEvent::Kind::kClosed);
    return false;
  }
  if (is_current && !talks_) return false;
  heard_at_.store(Clock::now().time_since_epoch().count(), std::memory_order_relaxed);
  if (is_current) busy_there_.store(opened->kind == Inner::kBusy, std::memory_order_relaxed);
  switch (opened->kind) {
    case Inner::kMessage:
      if (is_current && opened->newest && !(from == current_->address)) follow(from);
      return true;
    case Inner::kChallenge:
      if (is_current) send_inner(Inner::kResponse, datagram.view(), from);
      return false;
    case Inner::kResponse: {
      std::uint64_t nonce = 0;
      if (!is_current || datagram.size != sizeof nonce || move_.to.size == 0 || !(from == move_.to)) return false;
      std::memcpy(&nonce, datagram.bytes.data(), sizeof nonce);
      if (nonce != move_.nonce) return false;
      current_->address = from;
      move_.to = {};
      report(LinkEvent::Kind::kMoved);
      return false;
    }
    case Inner::kBusy: {
      talks_ = false;
      LinkEvent event{LinkEvent::Kind::kRefused, current_->address, {}, {}, Refusal::kBusy};
      const std::string_view name(reinterpret_cast<const char*>(datagram.bytes.data()), datagram.size);
      if (is_name(name)) std::copy(name.begin(), name.end(), event.name.begin());
      loop_events_.push(event);
      return false;
    }
  }
  return false;
}

/// An authentic datagram, the newest, came from elsewhere: it may also be a copy that somebody sends from there. Only
/// an answer to what is sent there says that the far end is there.
void SecureLink::follow(const SocketAddress& from) noexcept {
  const auto now = Clock::now();
  if (from == move_.to && now - move_.asked_at < kAskAgain) return;
  if (!(from == move_.to)) ++move_.nonce;
  move_.to = from;
  move_.asked_at = now;
  std::array<std::uint8_t, sizeof move_.nonce> nonce{};
  std::memcpy(nonce.data(), &move_.nonce, sizeof move_.nonce);
  send_inner(Inner::kChallenge, nonce, from);
}

void SecureLink::close() noexcept {
  Sealed sealed;
  if (talks_ && current_->session->seal_farewell(sealed)) (void)sockets_.marked.send(sealed.view(), current_->address);
  talks_ = false;
}

void SecureLink::report(LinkEvent::Kind kind) noexcept {
  loop_events_.push(event_of(kind, current_->address, current_->peer));
}

LinkEvent SecureLink::event_of(LinkEvent::Kind kind, const SocketAddress& address, const Fingerprint& peer) const {
  LinkEvent event{kind, address, peer, {}, Refusal::kNone};
  if (const Peer* known = context_.find(peer)) {
    const auto count = std::min(known->name.size(), event.name.size() - 1);
    std::copy_n(known->name.begin(), count, event.name.begin());
  }
  return event;
}

// --------------------------------------------------------------------------------------------- the handshakes' thread

void SecureLink::run() {
  while (!ending_.load(std::memory_order_relaxed)) {
    pollfd descriptor{sockets_.unmarked.descriptor(), POLLIN, 0};
    (void)::poll(&descriptor, 1, static_cast<int>(kPollTime.count()));
    const auto now = Clock::now();
    Offer* retired = nullptr;
    while (retired_.pop(retired)) delete retired;
    read_handshakes(now);
    tend(now);
    if (role_ == Role::kOperator) start_where_needed(now);
  }
}

void SecureLink::read_handshakes(Clock::time_point now) {
  if (now - hellos_at_ >= 100ms) {
    hellos_at_ = now;
    hellos_left_ = kHellosPer100ms;
  }
  std::array<std::uint8_t, kMostReceived> bytes;
  for (int i = 0; i < 4 * kHellosPer100ms; ++i) {
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
    To out(sockets_.unmarked, known->address);
    const auto progress = known->session->hear(bytes, out);
    if (!known->done) advance(*known, progress, now);
    return;
  }
  if (role_ == Role::kMachine && !hear_again(bytes, from)) hear_stranger(bytes, from, now);
}

/// A hello: of an end that is new here, or of one that has begun anew.
void SecureLink::hear_stranger(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now) {
  constexpr std::uint8_t kHandshakeRecord = 22;
  if (bytes[0] != kHandshakeRecord || hellos_left_ == 0 || handshakes_.size() >= kMostHandshakes) return;
  --hellos_left_;
  if (!listening_) listening_ = std::make_unique<DtlsSession>(context_);
  To out(sockets_.unmarked, from);
  if (!listening_->hear_hello(bytes, from, out)) return;
  Handshake& begun = handshakes_.emplace_back(Handshake{std::move(listening_), from, now});
  advance(begun, begun.session->start(out), now);
}

/// The far end of the offered session may not have heard our last words: then it says its own again.
bool SecureLink::hear_again(std::span<const std::uint8_t> bytes, const SocketAddress& from) {
  constexpr std::size_t kTypeOfMessage = 13;
  constexpr std::uint8_t kClientHello = 1;
  const bool hello =
      bytes.size() > kTypeOfMessage && bytes[3] == 0 && bytes[4] == 0 && bytes[kTypeOfMessage] == kClientHello;
  Offer* offer = hello ? nullptr : offered_.exchange(nullptr, std::memory_order_acquire);
  if (offer == nullptr) return false;
  const bool same = offer->address == from;
  if (same) {
    To out(sockets_.unmarked, offer->address);
    (void)offer->session->hear(bytes, out);
  }
  offered_.store(offer, std::memory_order_release);
  return same;
}

void SecureLink::advance(Handshake& handshake, DtlsSession::Progress progress, Clock::time_point now) {
  if (progress == DtlsSession::Progress::kUnderWay) return;
  handshake.done = true;
  if (progress == DtlsSession::Progress::kFailed) return fail(handshake, handshake.session->refusal());
  const bool other = holder_ && !(*holder_ == *handshake.session->peer());
  const bool held = other && (!silent() || now - made_at_ < timing_.silence);  // heard, or about to be
  if (role_ == Role::kMachine && held) return tell_busy(handshake);
  offer(handshake, now);
}

void SecureLink::offer(Handshake& handshake, Clock::time_point now) {
  const Fingerprint peer = *handshake.session->peer();
  const Tag tag = handshake.session->receive_tag();
  holder_ = peer;
  made_at_ = now;
  tags_ = {tag, tags_[0]};
  sockets_.marked.hear_only_beginning_with(tags_);
  auto offer = std::make_unique<Offer>(Offer{std::move(handshake.session), handshake.address, peer});
  offered_tag_.store(number_of(tag), std::memory_order_relaxed);
  delete offered_.exchange(offer.release(), std::memory_order_acq_rel);
  const std::lock_guard lock(problem_mutex_);
  problem_.clear();
}

/// Told a few times, since nobody confirms it.
void SecureLink::tell_busy(Handshake& handshake) {
  const Peer* holder = context_.find(*holder_);
  const std::string name = holder != nullptr ? holder->name : "";
  if (handshake.busy_told == 0) {
    LinkEvent event = event_of(LinkEvent::Kind::kRefused, handshake.address, *handshake.session->peer());
    event.refusal = Refusal::kBusy;
    put(event);
  }
  ++handshake.busy_told;
  Sealed sealed;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(name.data());
  if (handshake.session->seal(Inner::kBusy, {bytes, name.size()}, sealed))
    (void)sockets_.marked.send(sealed.view(), handshake.address);
}

void SecureLink::tend(Clock::time_point now) {
  for (std::size_t i = 0; i < handshakes_.size(); ++i) {
    Handshake& one = handshakes_[i];
    if (one.busy_told > 0 && one.busy_told < kBusyRepeats) {
      tell_busy(one);
      continue;
    }
    if (one.done) continue;
    if (now - one.since > timing_.answer) {
      one.done = true;
      fail(one, Refusal::kSilence);
      continue;
    }
    To out(sockets_.unmarked, one.address);
    advance(one, one.session->tend(out), now);
  }
  std::erase_if(handshakes_,
                [](const Handshake& one) { return one.done && (one.busy_told == 0 || one.busy_told >= kBusyRepeats); });
}

void SecureLink::fail(const Handshake& handshake, Refusal refusal) {
  const std::optional<Fingerprint>& peer = handshake.session->peer();
  LinkEvent event = event_of(LinkEvent::Kind::kRefused, handshake.address, peer.value_or(Fingerprint{}));
  event.refusal = refusal;
  put(event);
  if (role_ == Role::kMachine) return;
  try_at_ = Clock::now() + kTryAgain;
  const std::lock_guard lock(problem_mutex_);
  problem_ = text(handshake.address) + ": " + text(refusal);
}

/// Operator's side: all addresses of the far end at once; whichever answers first is it.
void SecureLink::start_where_needed(Clock::time_point now) {
  if (busy_there_.exchange(false, std::memory_order_relaxed)) {
    try_at_ = now + kTryAgain;
    holder_.reset();
    const std::lock_guard lock(problem_mutex_);
    problem_ = text(Refusal::kBusy);
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
    To out(sockets_.unmarked, begun.address);
    advance(begun, begun.session->start(out), now);
  }
}

}  // namespace knuckle::secure
