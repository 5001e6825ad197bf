#include "app/pairing/pairing_exchange.h"

#include <poll.h>

#include <array>
#include <chrono>
#include <exception>
#include <set>

#include "core/error.h"
#include "transport/udp_socket.h"

namespace knuckle::pairing {
namespace {

using secure::DtlsContext;
using secure::DtlsSession;
using secure::HandshakeOut;
using Progress = DtlsSession::Progress;
using Clock = std::chrono::steady_clock;

constexpr int kPollTime_ms = 20, kMostAtOnce = 256;
constexpr auto kPatience = std::chrono::seconds(5);
constexpr auto kSayAgain = std::chrono::milliseconds(50);
constexpr auto kParting = std::chrono::seconds(3);
constexpr auto kLastWords = std::chrono::milliseconds(250);  // so that the far end hears that it was heard

/// One for each address that this computer can use, at least one.
std::vector<UdpSocket> open_sockets(const std::vector<SocketAddress>& addresses, bool listening) {
  std::vector<UdpSocket> sockets;
  std::exception_ptr refused;
  for (const SocketAddress& address : addresses) {
    try {
      sockets.emplace_back(
          open_udp_socket(text(address), address, listening ? ::bind : ::connect, listening ? "listen on" : "reach"));
    } catch (const InputError&) {
      refused = std::current_exception();
    }
  }
  if (sockets.empty()) std::rethrow_exception(refused);
  return sockets;
}

}  // namespace

class PairingExchange::Meeting {
 public:
  Meeting(secure::Role role, const std::vector<SocketAddress>& addresses, const secure::Identity& own)
      : identity(own),
        listening_(role == secure::Role::kMachine),
        context_(own, {}, role, secure::Purpose::kPair),
        sockets_(open_sockets(addresses, listening_)) {
    begin();
  }

  /// @return whether both have shown their certificates.
  bool step() {
    listen();
    if (progress_ == Progress::kDone) return true;
    if (begun_ && progress_ == Progress::kUnderWay) {
      HandshakeOut out(socket(), peer_);
      took(session_->tend(out));
    }
    const bool failed = progress_ == Progress::kFailed;
    if (!failed && (!begun_ || Clock::now() - since_ <= kPatience)) return false;
    failure_ = failed ? session_->refusal() : secure::Refusal::kSilence;
    current_ = (current_ + 1) % sockets_.size();
    begin();
    return false;
  }
  /// After step() has been true.
  void serve() {
    listen();
    if (Clock::now() - said_at_ >= kSayAgain) tell();
  }
  /// Each datagram says all: this end's verdict, and what it has heard of the other's.
  void tell() {
    said_at_ = Clock::now();
    const std::array<std::uint8_t, 2> text{static_cast<std::uint8_t>(said), static_cast<std::uint8_t>(heard)};
    secure::Sealed sealed;
    if (session_->seal(secure::Inner::kVerdict, text, sealed)) (void)socket().send(sealed.view(), peer_);
  }
  [[nodiscard]] bool gone() const { return Clock::now() - since_ >= kGone; }
  [[nodiscard]] const DtlsSession& session() const noexcept { return *session_; }
  /// Of the last attempt that failed.
  [[nodiscard]] secure::Refusal failure() const noexcept { return failure_; }

  const secure::Identity& identity;
  Verdict said = Verdict::kNone, heard = Verdict::kNone;
  Verdict heard_there = Verdict::kNone;  ///< Of this end's, as the far end says.

 private:
  [[nodiscard]] const UdpSocket& socket() const noexcept { return sockets_[current_]; }
  void listen() {
    pollfd descriptor{socket().descriptor(), POLLIN, 0};
    (void)::poll(&descriptor, 1, kPollTime_ms);
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    for (int i = 0; i < kMostAtOnce; ++i) {
      const auto arrival = socket().receive(bytes, from);
      if (!arrival) break;
      if (arrival->size > 0 && arrival->size <= bytes.size()) hear(std::span(bytes).first(arrival->size), from);
    }
  }
  void took(Progress progress) {
    if (progress == Progress::kDone && progress_ != Progress::kDone) since_ = Clock::now();
    progress_ = progress;
  }
  void begin() {
    session_ = std::make_unique<DtlsSession>(context_);
    progress_ = Progress::kUnderWay;
    begun_ = !listening_;
    since_ = Clock::now();
    if (!begun_) return;
    HandshakeOut out(socket(), peer_);
    took(session_->start(out));
  }
  void hear(std::span<const std::uint8_t> bytes, const SocketAddress& from) {
    if (begun_ && listening_ && !(from == peer_)) return;
    if (bytes[0] >= secure::kObserverTagMark) return hear_verdict(bytes);
    if (!begun_) peer_ = from;
    HandshakeOut out(socket(), peer_);
    if (begun_) return took(session_->hear(bytes, out));
    if (!session_->hear_hello(bytes, from, out)) return;
    begun_ = true;
    since_ = Clock::now();
    took(session_->start(out));
  }

  void hear_verdict(std::span<const std::uint8_t> bytes) {
    if (progress_ != Progress::kDone || !session_->mine(bytes)) return;
    Datagram plain;
    const auto opened = session_->open(bytes, plain);
    constexpr auto kLast = static_cast<std::uint8_t>(Verdict::kNo);
    if (!opened || !opened->newest || opened->kind != secure::Inner::kVerdict || plain.size != 2) return;
    if (plain.bytes[0] > kLast || plain.bytes[1] > kLast) return;
    heard = static_cast<Verdict>(plain.bytes[0]);
    heard_there = static_cast<Verdict>(plain.bytes[1]);
    since_ = Clock::now();
  }

  bool listening_, begun_ = false;
  DtlsContext context_;
  std::vector<UdpSocket> sockets_;  // of every attempt the next one
  std::size_t current_ = 0;
  SocketAddress peer_;  // stays empty on a socket that is connected
  std::unique_ptr<DtlsSession> session_;
  Progress progress_ = Progress::kUnderWay;
  secure::Refusal failure_ = secure::Refusal::kNone;
  Clock::time_point since_{};  // this attempt; once it has succeeded: the far end was heard last
  Clock::time_point said_at_{};
};

PairingExchange::PairingExchange(secure::Role role, const std::vector<SocketAddress>& addresses,
                                 const secure::Identity& identity)
    : meeting_(std::make_unique<Meeting>(role, addresses, identity)) {}

PairingExchange::~PairingExchange() = default;

std::optional<Shown> PairingExchange::meet(const std::function<bool()>& keep_on,
                                           const std::function<void(const std::string&)>& tell) {
  std::set<secure::Refusal> told{secure::Refusal::kNone};
  while (!meeting_->step()) {
    if (!keep_on()) return std::nullopt;
    if (told.insert(meeting_->failure()).second && tell) tell(secure::text(meeting_->failure()));
  }
  const DtlsSession& session = meeting_->session();
  const secure::Fingerprint there = *session.peer();
  return Shown{there, session.peer_name(), secure::pairing_code(meeting_->identity.fingerprint(), there),
               session.peer_expires_utc()};
}

void PairingExchange::serve() {
  meeting_->serve();
}

void PairingExchange::say(Verdict verdict) {
  meeting_->said = verdict;
  meeting_->tell();
}

bool PairingExchange::part() {
  if (gone()) return false;
  const auto was_heard = [this] { return meeting_->heard_there == meeting_->said; };
  for (const auto until = Clock::now() + kParting; !was_heard() && Clock::now() < until;) serve();
  for (const auto until = Clock::now() + kLastWords; Clock::now() < until;) serve();
  return was_heard();
}

Verdict PairingExchange::heard() const noexcept {
  return meeting_->heard;
}

bool PairingExchange::gone() const noexcept {
  return meeting_->gone();
}

}  // namespace knuckle::pairing
