#include "app/pairing/pairing_exchange.h"

#include <poll.h>

#include <array>
#include <chrono>
#include <memory>

#include "core/error.h"
#include "transport/udp_socket.h"

namespace knuckle::pairing {
namespace {

using secure::DtlsContext;
using secure::DtlsSession;
using Progress = DtlsSession::Progress;
using Clock = std::chrono::steady_clock;

constexpr int kPollTime_ms = 20;
constexpr auto kLinger = std::chrono::milliseconds(1500);  // the far end may not have heard our last words
constexpr auto kPatience = std::chrono::seconds(5);

class Exchange final : DtlsSession::Out {
 public:
  Exchange(secure::Role role, const std::string& address, const secure::Identity& identity)
      : listening_(role == secure::Role::kMachine),
        context_(identity, {}, role, true),
        socket_(listening_ ? open_udp_socket(address, parse_address(address), ::bind, "listen on")
                           : open_udp_socket(address, look_up(address).front(), ::connect, "reach")) {
    begin();
  }

  /// @return whether both have shown their certificates, and long enough ago.
  bool step() {
    pollfd descriptor{socket_.descriptor(), POLLIN, 0};
    (void)::poll(&descriptor, 1, kPollTime_ms);
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto arrival = socket_.receive(bytes, from)) {
      if (arrival->size > 0 && arrival->size <= bytes.size()) hear(std::span(bytes).first(arrival->size), from);
    }
    if (progress_ == Progress::kDone) return Clock::now() - since_ >= kLinger;
    if (begun_) took(session_->tend(*this));
    if (progress_ == Progress::kFailed || (begun_ && Clock::now() - since_ > kPatience)) begin();
    return false;
  }
  [[nodiscard]] const DtlsSession& session() const noexcept { return *session_; }

 private:
  void put(std::span<const std::uint8_t> bytes) override { (void)socket_.send(bytes, peer_); }
  void took(Progress progress) {
    if (progress == Progress::kDone && progress_ != Progress::kDone) since_ = Clock::now();
    progress_ = progress;
  }
  void begin() {
    session_ = std::make_unique<DtlsSession>(context_);
    progress_ = Progress::kUnderWay;
    begun_ = !listening_;
    since_ = Clock::now();
    if (begun_) took(session_->start(*this));
  }
  void hear(std::span<const std::uint8_t> bytes, const SocketAddress& from) {
    if (begun_ && (!listening_ || from == peer_)) return took(session_->hear(bytes, *this));
    if (begun_) return;
    peer_ = from;
    if (!session_->hear_hello(bytes, from, *this)) return;
    begun_ = true;
    since_ = Clock::now();
    took(session_->start(*this));
  }

  bool listening_, begun_ = false;
  DtlsContext context_;
  UdpSocket socket_;
  SocketAddress peer_;  // stays empty on a socket that is connected
  std::unique_ptr<DtlsSession> session_;
  Progress progress_ = Progress::kUnderWay;
  Clock::time_point since_{};
};

}  // namespace

std::optional<Shown> exchange(secure::Role role, const std::string& address, const secure::Identity& identity,
                              const std::function<bool()>& keep_on) {
  Exchange running(role, address, identity);
  while (!running.step()) {
    if (!keep_on()) return std::nullopt;
  }
  const secure::Fingerprint there = *running.session().peer();
  return Shown{there, running.session().peer_name(), secure::pairing_code(identity.fingerprint(), there)};
}

}  // namespace knuckle::pairing
