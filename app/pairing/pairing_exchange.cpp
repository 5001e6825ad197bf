#include "app/pairing/pairing_exchange.h"

#include <poll.h>

#include <array>
#include <chrono>
#include <exception>
#include <memory>
#include <set>

#include "core/error.h"
#include "transport/secure/handshake_out.h"
#include "transport/udp_socket.h"

namespace knuckle::pairing {
namespace {

using secure::DtlsContext;
using secure::DtlsSession;
using secure::HandshakeOut;
using Progress = DtlsSession::Progress;
using Clock = std::chrono::steady_clock;

constexpr int kPollTime_ms = 20, kMostAtOnce = 256;
constexpr auto kLinger = std::chrono::milliseconds(1500);  // the far end may not have heard our last words
constexpr auto kPatience = std::chrono::seconds(5);

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

class Exchange {
 public:
  Exchange(secure::Role role, const std::vector<SocketAddress>& addresses, const secure::Identity& identity)
      : listening_(role == secure::Role::kMachine),
        context_(identity, {}, role, secure::Purpose::kControl, true),
        sockets_(open_sockets(addresses, listening_)) {
    begin();
  }

  /// @return whether both have shown their certificates, and long enough ago.
  bool step() {
    pollfd descriptor{socket().descriptor(), POLLIN, 0};
    (void)::poll(&descriptor, 1, kPollTime_ms);
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    for (int i = 0; i < kMostAtOnce; ++i) {
      const auto arrival = socket().receive(bytes, from);
      if (!arrival) break;
      if (arrival->size > 0 && arrival->size <= bytes.size()) hear(std::span(bytes).first(arrival->size), from);
    }
    if (progress_ == Progress::kDone) return Clock::now() - since_ >= kLinger;
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
  [[nodiscard]] const DtlsSession& session() const noexcept { return *session_; }
  /// Of the last attempt that failed.
  [[nodiscard]] secure::Refusal failure() const noexcept { return failure_; }

 private:
  [[nodiscard]] const UdpSocket& socket() const noexcept { return sockets_[current_]; }
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
    if (!begun_) peer_ = from;
    HandshakeOut out(socket(), peer_);
    if (begun_) return took(session_->hear(bytes, out));
    if (!session_->hear_hello(bytes, from, out)) return;
    begun_ = true;
    since_ = Clock::now();
    took(session_->start(out));
  }

  bool listening_, begun_ = false;
  DtlsContext context_;
  std::vector<UdpSocket> sockets_;  // of every attempt the next one
  std::size_t current_ = 0;
  SocketAddress peer_;  // stays empty on a socket that is connected
  std::unique_ptr<DtlsSession> session_;
  Progress progress_ = Progress::kUnderWay;
  secure::Refusal failure_ = secure::Refusal::kNone;
  Clock::time_point since_{};
};

}  // namespace

std::optional<Shown> exchange(secure::Role role, const std::vector<SocketAddress>& addresses,
                              const secure::Identity& identity, const std::function<bool()>& keep_on,
                              const std::function<void(const std::string&)>& tell) {
  Exchange running(role, addresses, identity);
  std::set<secure::Refusal> told{secure::Refusal::kNone};
  while (!running.step()) {
    if (!keep_on()) return std::nullopt;
    if (told.insert(running.failure()).second && tell) tell(secure::text(running.failure()));
  }
  const DtlsSession& session = running.session();
  const secure::Fingerprint there = *session.peer();
  return Shown{there, session.peer_name(), secure::pairing_code(identity.fingerprint(), there),
               session.peer_expires_utc()};
}

}  // namespace knuckle::pairing
