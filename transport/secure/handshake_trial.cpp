#include "transport/secure/handshake_trial.h"

#include <poll.h>

#include <array>
#include <cerrno>

#include "transport/secure/dtls_session.h"

namespace knuckle::secure {
namespace {

using Clock = std::chrono::steady_clock;
using Progress = DtlsSession::Progress;
constexpr int kPollTime_ms = 10, kMostAtOnce = 64;
constexpr auto kAnswerTime = std::chrono::milliseconds(1000);  // after the handshake, to hear who has control
constexpr std::uint8_t kFirstDtlsType = 20, kLastDtlsType = 25;

class Attempt {
 public:
  Attempt(const SocketAddress& address, const Identity& identity, const Peers& peers)
      : context_(identity, peers, Role::kOperator, Purpose::kTry),
        session_(context_),
        socket_(open_udp_socket(text(address), address, ::connect, "reach")),
        out_(socket_, to_) {
    progress_ = session_.start(out_);
  }

  /// @return whether it is over.
  bool step() {
    pollfd descriptor{socket_.descriptor(), POLLIN, 0};
    (void)::poll(&descriptor, 1, kPollTime_ms);
    for (int i = 0; i < kMostAtOnce && !over(); ++i) {
      std::array<std::uint8_t, 2048> bytes;
      SocketAddress from;
      errno = 0;
      const auto arrival = socket_.receive(bytes, from);
      if (!arrival) {
        trial_.port_closed = errno == ECONNREFUSED;
        break;
      }
      if (arrival->size > 0 && arrival->size <= bytes.size()) hear(std::span(bytes).first(arrival->size));
    }
    if (progress_ == Progress::kUnderWay) took(session_.tend(out_));
    return over();
  }
  [[nodiscard]] Trial result(bool patient) {
    trial_.refusal = progress_ == Progress::kDone ? Refusal::kNone : session_.refusal();
    if (!patient || trial_.port_closed) trial_.refusal = Refusal::kSilence;
    trial_.peer = session_.peer();
    trial_.peer_name = session_.peer_name();
    return trial_;
  }
  [[nodiscard]] bool shaken() const { return progress_ == Progress::kDone; }

 private:
  [[nodiscard]] bool over() const {
    return progress_ == Progress::kFailed || trial_.port_closed || answered_ ||
           (shaken() && Clock::now() - done_at_ >= kAnswerTime);
  }
  void took(Progress progress) {
    if (progress == Progress::kDone && !shaken()) done_at_ = Clock::now();
    progress_ = progress;
  }
  void hear(std::span<const std::uint8_t> bytes) {
    if (bytes[0] >= kFirstDtlsType && bytes[0] <= kLastDtlsType) return took(session_.hear(bytes, out_));
    if (!shaken()) {
      trial_.not_dtls = true;
      return;
    }
    Datagram plain;
    const auto opened = session_.mine(bytes) ? session_.open(bytes, plain) : std::nullopt;
    if (!opened || opened->kind != Inner::kAnswer || plain.size == 0) return;
    answered_ = true;
    trial_.busy = plain.bytes[0] == static_cast<std::uint8_t>(Refusal::kBusy);
    const std::string_view name(reinterpret_cast<const char*>(plain.bytes.data()) + 1, plain.size - std::size_t{1});
    if (is_name(name)) trial_.holder = name;
  }

  const SocketAddress to_;  // empty: the socket is connected
  DtlsContext context_;
  DtlsSession session_;
  UdpSocket socket_;
  HandshakeOut out_;
  Progress progress_ = Progress::kUnderWay;
  bool answered_ = false;
  Clock::time_point done_at_{};
  Trial trial_;
};

}  // namespace

Trial try_handshake(const SocketAddress& address, const Identity& identity, const Peers& peers,
                    std::chrono::milliseconds patience, const std::function<bool()>& keep_on) {
  Attempt attempt(address, identity, peers);
  const auto until = Clock::now() + patience;
  bool over = false;
  while (!over && keep_on() && (Clock::now() < until || attempt.shaken())) over = attempt.step();
  return attempt.result(over);
}

}  // namespace knuckle::secure
