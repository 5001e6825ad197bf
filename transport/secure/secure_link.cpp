#include "transport/secure/secure_link.h"

#include <netinet/in.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>

#include "core/error.h"

namespace knuckle::secure {
namespace {

using namespace std::chrono_literals;

constexpr auto kAskAgain = 50ms;     // a new address, whether it is the far end's
constexpr auto kSayAlive = 300ms;    // an observer
constexpr auto kSameAsker = 5000ms;  // of the repeats of one request
constexpr int kRepeats = 3;          // of what nobody confirms
constexpr int kMostSkipped = 32;

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

/// "desk 1 (QF3K-...)"
std::string named(const PeerName& name, const Fingerprint& peer) {
  return (name.view().empty() ? "" : std::string(name.view()) + " ") + "(" + short_text(peer) + ")";
}

std::vector<SocketAddress> look_up_target(const std::string& address) {
  std::vector<SocketAddress> targets = look_up(address);
  if (targets.front().port() == 0)
    throw InputError("link: " + address + ": port 0 cannot be used; give the port that the other side listens on");
  if (targets.front().is_any()) throw InputError("link: " + address + ": is no single computer's address");
  return targets;
}

}  // namespace

PeerName::PeerName(std::string_view name) noexcept {
  if (is_name(name)) std::copy(name.begin(), name.end(), text.begin());
}

std::string text(const LinkEvent& event) {
  const std::string name(event.name.view());
  const std::string at = event.address.size == 0 ? "" : " at " + text(event.address);
  const std::string who = event.peer == Fingerprint{} ? "" : named(event.name, event.peer);
  switch (event.kind) {
    case LinkEvent::Kind::kConnected:
      return "connected: " + who + at;
    case LinkEvent::Kind::kRenewed:
      return "connected anew: " + who + at;
    case LinkEvent::Kind::kMoved:
      return "moved: " + who + ", now" + at;
    case LinkEvent::Kind::kEnded:
      return "ended by " + who + at + ": it has stopped, or no longer admits this computer";
    case LinkEvent::Kind::kClosed:
      return "control released by " + who + at;
    case LinkEvent::Kind::kCutOff:
      return "cut off: " + who + at + ": " + text(event.refusal);
    case LinkEvent::Kind::kAsked:
      return who + " asks for control";
    case LinkEvent::Kind::kGranted:
      return who + " lets " + named(event.other_name, event.other) + " have control";
    case LinkEvent::Kind::kObserves:
      return "observer connected: " + who + at;
    case LinkEvent::Kind::kObserved:
      return "observer gone: " + who + at;
    case LinkEvent::Kind::kTried:
      return "handshake tried by " + who + at;
    case LinkEvent::Kind::kRefused:
      break;
  }
  if (event.refusal == Refusal::kBusy && who.empty())
    return "refused" + at + ": " + (name.empty() ? "somebody else" : name) + " has control there";
  return "refused" + (who.empty() ? at : ": " + who + at) + ": " + text(event.refusal);
}

std::unique_ptr<SecureLink> SecureLink::listen(const std::string& address, const Identity& identity, Peers peers,
                                               const SecureLinkTiming& timing, SecureLinkAccess access) {
  return std::unique_ptr<SecureLink>(new SecureLink(open_socket_pair(address, parse_address(address), kTagMark),
                                                    identity, std::move(peers), Role::kMachine, {}, timing,
                                                    std::move(access)));
}

std::unique_ptr<SecureLink> SecureLink::connect(const std::string& address, const Identity& identity, Peers peers,
                                                const SecureLinkTiming& timing, SecureLinkAccess access) {
  std::vector<SocketAddress> targets = look_up_target(address);
  const bool six = std::any_of(targets.begin(), targets.end(),
                               [](const SocketAddress& one) { return one.bytes.ss_family == AF_INET6; });
  if (six) std::transform(targets.begin(), targets.end(), targets.begin(), mapped);
  const std::string here = six ? "[::]:0" : "0.0.0.0:0";
  return std::unique_ptr<SecureLink>(new SecureLink(open_socket_pair(here, parse_address(here), kTagMark), identity,
                                                    std::move(peers), Role::kOperator, std::move(targets), timing,
                                                    std::move(access)));
}

SecureLink::SecureLink(SocketPair sockets, const Identity& identity, Peers peers, Role role,
                       std::vector<SocketAddress> targets, const SecureLinkTiming& timing, SecureLinkAccess access)
    : sockets_(std::move(sockets)),
      context_(identity, std::move(peers), role, access.purpose),
      role_(role),
      targets_(std::move(targets)),
      timing_(timing),
      access_(std::move(access)) {
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

void SecureLink::release() noexcept {
  released_.store(true, std::memory_order_relaxed);
  releases_.put({});
}

void SecureLink::grant(const Fingerprint& to) noexcept {
  released_.store(true, std::memory_order_relaxed);
  releases_.put({true, to});
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

/// The ring has room: the handshakes' thread, which makes what is retired here, empties it before it makes the next.
void SecureLink::retire(std::unique_ptr<Offer>& offer) noexcept {
  if (offer) retired_.push(offer.release());
}

void SecureLink::take_offer() noexcept {
  if (offered_.load(std::memory_order_relaxed) == nullptr) return;
  std::unique_ptr<Offer> offer(offered_.exchange(nullptr, std::memory_order_acquire));
  if (!offer) return;
  if (released_.load(std::memory_order_relaxed)) return retire(offer);
  const bool same = offer->renews && current_ && current_->peer == offer->peer;
  const bool renewed = talks_ && same;
  retire(previous_);
  if (same) {
    previous_ = std::move(current_);
  } else if (current_) {
    // Who had control before is not heard any more, and who has it now only when the loop knows that nobody led.
    retire(current_);
    quiet_until_ = Clock::now() + kHandOverGap;
  }
  current_ = std::move(offer);
  video_secrets_.put(current_->session->video_secret());
  talks_ = true;
  move_ = {};
  asks_left_ = 0;
  untold_ = renewed ? LinkEvent::Kind::kRenewed : LinkEvent::Kind::kConnected;
  if (role_ == Role::kMachine) tell_of_session();
}

/// On the operator's side after the machine's first message: who is not let in has a session as well, for the answer.
void SecureLink::tell_of_session() noexcept {
  if (untold_) report(*untold_);
  untold_.reset();
}

bool SecureLink::send(std::span<const std::uint8_t> bytes) noexcept {
  if (role_ == Role::kOperator) take_offer();
  release_where_asked();
  cut_off_where_asked();
  if (access_.purpose == Purpose::kObserve) {
    const auto now = Clock::now();
    if (talks_ && now - said_alive_at_ >= kSayAlive) {
      said_alive_at_ = now;
      send_inner(Inner::kAlive, {}, current_->address);
    }
    return false;
  }
  if (observer_count_.load(std::memory_order_relaxed) > 0 && bytes.size() <= kMaxDatagram) {
    Datagram copy;
    copy.size = static_cast<std::uint16_t>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), copy.bytes.begin());
    copies_.push(copy);
  }
  if (!talks_ || (role_ == Role::kMachine && silent())) return false;
  Sealed sealed;
  if (!current_->session->seal(Inner::kMessage, bytes, sealed)) return false;
  // The first may only have told of an error that was noted before.
  return sockets_.marked.send(sealed.view(), current_->address) == 0 ||
         sockets_.marked.send(sealed.view(), current_->address) == 0;
}

void SecureLink::send_inner(Inner kind, std::span<const std::uint8_t> bytes, const SocketAddress& to) noexcept {
  Sealed sealed;
  if (current_->session->seal(kind, bytes, sealed)) (void)sockets_.marked.send(sealed.view(), to);
}

bool SecureLink::receive(Datagram& datagram) noexcept {
  if (role_ == Role::kOperator) take_offer();
  cut_off_where_asked();
  tell_of_asker();
  std::array<std::uint8_t, kMostReceived> bytes;
  emptied_ = false;
  for (int i = 0; i < kMostSkipped; ++i) {
    SocketAddress from;
    const auto arrival = sockets_.marked.receive(bytes, from);
    if (!arrival) {
      emptied_ = errno == EAGAIN || errno == EWOULDBLOCK;
      if (emptied_) return false;
      continue;  // an error that was noted for this socket: anybody can send an ICMP message
    }
    if (arrival->size <= kTagSize || arrival->size > bytes.size()) continue;
    const std::span received = std::span<const std::uint8_t>(bytes).first(arrival->size);
    Tag tag;
    std::copy_n(received.begin(), kTagSize, tag.begin());
    // Whoever seals with the offered session has finished its handshake.
    if (role_ == Role::kMachine && number_of(tag) == offered_tag_.load(std::memory_order_relaxed)) take_offer();
    if (!open(received, from, datagram)) continue;
    datagram.waited = arrival->waited;
    other_version_.note(datagram.view());
    return true;
  }
  return false;
}

bool SecureLink::open(std::span<const std::uint8_t> bytes, const SocketAddress& from, Datagram& datagram) noexcept {
  const bool is_current = current_ && current_->session->mine(bytes);
  Offer* of = is_current ? current_.get() : previous_.get();
  if (of == nullptr || (!is_current && !of->session->mine(bytes))) return false;
  const auto opened = of->session->open(bytes, datagram);
  if (!talks_) return false;
  if (!opened) {
    if (!is_current || !of->session->closed()) return false;
    stop_talking();
    heard_at_.store(0, std::memory_order_relaxed);
    report(role_ == Role::kMachine ? LinkEvent::Kind::kClosed : LinkEvent::Kind::kEnded);
    return false;
  }
  const auto now = Clock::now();
  if (opened->kind != Inner::kAnswer) heard_at_.store(now.time_since_epoch().count(), std::memory_order_relaxed);
  if (is_current && opened->kind == Inner::kMessage) tell_of_session();
  if (opened->kind != Inner::kMessage) return is_current && obey(opened->kind, from, datagram);
  if (role_ == Role::kMachine && is_current && opened->newest && !(from == current_->address)) follow(from);
  return now >= quiet_until_;
}

/// What the far end's link says to this one. @return false: none of it is for the loop.
bool SecureLink::obey(Inner kind, const SocketAddress& from, const Datagram& datagram) noexcept {
  const bool machine = role_ == Role::kMachine;
  // Only back where the machine is: who relays its question does not get the session.
  if (kind == Inner::kChallenge && !machine && from == current_->address)
    send_inner(Inner::kResponse, datagram.view(), from);
  if (kind == Inner::kResponse) moved(from, datagram);
  if (kind == Inner::kAnswer && !machine) hear_answer(datagram);
  if (kind == Inner::kAsked && !machine) hear_asker(datagram);
  if (kind == Inner::kGrant && machine && datagram.size == sizeof(Fingerprint)) {
    Fingerprint to;
    std::memcpy(to.bytes.data(), datagram.bytes.data(), to.bytes.size());
    grants_.put(to);
    if (!(to == asker_.peer)) return false;  // of the repeats of a grant, one is reported
    loop_events_.push({LinkEvent::Kind::kGranted, current_->address, current_->peer, current_->name, Refusal::kNone, to,
                       asker_.name});
    asker_ = {};
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

void SecureLink::moved(const SocketAddress& from, const Datagram& datagram) noexcept {
  std::uint64_t nonce = 0;
  if (datagram.size != sizeof nonce || move_.to.size == 0 || !(from == move_.to)) return;
  std::memcpy(&nonce, datagram.bytes.data(), sizeof nonce);
  if (nonce != move_.nonce) return;
  current_->address = from;
  move_.to = {};
  moves_.put(from);
  report(LinkEvent::Kind::kMoved);
}

/// Operator's side: it is not let in although its handshake succeeded.
void SecureLink::hear_answer(const Datagram& datagram) noexcept {
  if (datagram.size == 0) return;
  Refusal refusal = Refusal::kBusy;
  for (const Refusal known : {Refusal::kFull, Refusal::kNoObservers})
    if (datagram.bytes[0] == static_cast<std::uint8_t>(known)) refusal = known;
  LinkEvent event{LinkEvent::Kind::kRefused, current_->address, {}, {}, refusal};
  event.name = PeerName({reinterpret_cast<const char*>(datagram.bytes.data()) + 1, datagram.size - std::size_t{1}});
  stop_talking();
  untold_.reset();
  heard_at_.store(0, std::memory_order_relaxed);
  refused_by_.put({event.refusal, event.name});
  loop_events_.push(event);
}

/// Operator's side: somebody wants the control that this end has.
void SecureLink::hear_asker(const Datagram& datagram) noexcept {
  Asker asker;
  const std::size_t size = asker.peer.bytes.size();
  if (datagram.size < size) return;
  std::copy_n(datagram.bytes.begin(), size, asker.peer.bytes.begin());
  asker.name = PeerName({reinterpret_cast<const char*>(datagram.bytes.data()) + size, datagram.size - size});
  const auto now = Clock::now();
  if (asker.peer == asker_.peer && now - asked_at_ < kSameAsker) return;
  asker_ = asker;
  asked_at_ = now;
  loop_events_.push({LinkEvent::Kind::kAsked, current_->address, asker.peer, asker.name, Refusal::kNone, {}});
}

/// Machine's side: a few times, since nobody confirms it.
void SecureLink::tell_of_asker() noexcept {
  if (role_ != Role::kMachine || !talks_) return;
  if (askers_.take(asker_)) asks_left_ = kRepeats;
  if (asks_left_ == 0) return;
  --asks_left_;
  std::array<std::uint8_t, sizeof(Fingerprint) + kMostNameLength> text{};
  const std::string_view name = asker_.name.view();
  std::copy(name.begin(), name.end(), std::copy(asker_.peer.bytes.begin(), asker_.peer.bytes.end(), text.begin()));
  send_inner(Inner::kAsked, std::span(text).first(sizeof(Fingerprint) + name.size()), current_->address);
}

void SecureLink::release_where_asked() noexcept {
  Release release;
  if (!releases_.take(release) || !talks_) return;
  for (int i = 0; release.grants && i < kRepeats; ++i) send_inner(Inner::kGrant, release.to.bytes, current_->address);
  say_farewell();
  heard_at_.store(0, std::memory_order_relaxed);
}

void SecureLink::cut_off_where_asked() noexcept {
  Fingerprint peer;
  if (!cut_offs_.take(peer) || !talks_ || !(current_->peer == peer)) return;
  say_farewell();
  heard_at_.store(0, std::memory_order_relaxed);
}

/// The same record a few times: only the first that comes is opened.
void SecureLink::say_farewell() noexcept {
  Sealed sealed;
  if (current_->session->seal_farewell(sealed)) {
    for (int i = 0; i < kRepeats; ++i) (void)sockets_.marked.send(sealed.view(), current_->address);
  }
  stop_talking();
}

/// Whoever had the session sees no more pictures, either.
void SecureLink::stop_talking() noexcept {
  talks_ = false;
  video_secrets_.put(std::nullopt);
}

void SecureLink::close() noexcept {
  released_.store(true, std::memory_order_relaxed);
  if (talks_) say_farewell();
}

void SecureLink::report(LinkEvent::Kind kind) noexcept {
  loop_events_.push({kind, current_->address, current_->peer, current_->name, Refusal::kNone, {}});
}

}  // namespace knuckle::secure
