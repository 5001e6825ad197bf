#include <netinet/in.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "app/relay/relay.h"

namespace knuckle::relay {
namespace {

UdpSocket open_upstream(const SocketAddress& connect) {
  return UdpSocket(open_udp_socket(text(connect), connect, ::connect, "send to"));
}

/// The same host, any port.
SocketAddress with_any_port(SocketAddress address) {
  auto& port = address.bytes.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(address.bytes).sin6_port
                                                   : reinterpret_cast<sockaddr_in&>(address.bytes).sin_port;
  port = 0;
  return address;
}

}  // namespace

Flow::Flow(std::uint64_t number, const SocketAddress& operators, const RelayPlan& plan, const UdpSocket& listening,
           Time now)
    : plan_(plan),
      listening_(listening),
      upstream_(open_upstream(plan.connect)),
      to_machine_(plan.to_machine, 2 * (plan.seed + number - 1)),  // the first one's are those of ImpairedLink
      to_operator_(plan.to_operator, 2 * (plan.seed + number - 1) + 1) {
  report_.number = number;
  report_.operators = operators;
  report_.began_at = report_.heard_at = now;
}

void Flow::add(Path& path, std::span<const std::uint8_t> bytes, Time arrived_at) noexcept {
  path.newest = std::max(path.newest, in_plan(arrived_at));
  path.path.send(bytes, path.newest);
}

void Flow::from_operator(std::span<const std::uint8_t> bytes, Time arrived_at, bool through_listening) noexcept {
  if (through_listening && answers_) {
    ++report_.to_machine.old_address;
    return;
  }
  report_.heard_at = arrived_at;
  add(to_machine_, bytes, arrived_at);
}

void Flow::receive(const RealtimeClock& clock, std::span<std::uint8_t> buffer) noexcept {
  SocketAddress from;
  for (int i = 0; i < kAtOnce; ++i) {
    errno = 0;
    const auto arrival = upstream_.receive(buffer, from);
    if (!arrival) {
      note_error(errno);
      break;
    }
    refused_ = refusal_taken_ = false;
    if (arrival->size > kMostBytes) {
      ++report_.to_operator.too_long;
    } else {
      add(to_operator_, buffer.first(arrival->size), clock.now() - arrival->waited);
    }
  }
  for (int i = 0; answers_ && i < kAtOnce; ++i) {
    const auto arrival = answers_->receive(buffer, from);
    if (!arrival) break;
    if (!(from == report_.operators)) continue;  // nobody else knows this address
    if (arrival->size > kMostBytes) {
      too_long_from_operator();
    } else {
      from_operator(buffer.first(arrival->size), clock.now() - arrival->waited, false);
    }
  }
}

void Flow::send_due(const RealtimeClock& clock) noexcept {
  forward(to_machine_, report_.to_machine, upstream_, {}, clock);
  forward(to_operator_, report_.to_operator, answers_ ? *answers_ : listening_, report_.operators, clock);
}

void Flow::forward(Path& path, DirectionReport& report, const UdpSocket& socket, const SocketAddress& to,
                   const RealtimeClock& clock) noexcept {
  for (int i = 0; i < kAtOnce; ++i) {
    const Time now = in_plan(clock.now());
    const auto arrival = path.path.front(now);
    if (!arrival) return;
    if (const int error = socket.send(arrival->bytes, to); error != 0) {
      ++report.not_sent;
      note_error(error);
    } else {
      ++report.forwarded;
      report.forwarded_bytes += arrival->bytes.size();
      report.delay.add(now - arrival->sent_at);
      report.lateness.add(now - arrival->due_at);
    }
    path.path.pop();
  }
}

void Flow::note_error(int error) noexcept {
  refused_ |= error == ECONNREFUSED;
}

bool Flow::take_refusal() noexcept {
  return refused_ && !std::exchange(refusal_taken_, true);
}

SocketAddress Flow::change_address_to_machine() {
  // Both are open for a moment, so that the port is another one. What is under way to the old one is lost.
  upstream_ = open_upstream(plan_.connect);
  ++report_.to_machine.address_changes;
  return local_address(upstream_.descriptor());
}

SocketAddress Flow::change_address_to_operator() {
  answers_ = UdpSocket(open_udp_socket(text(plan_.listen), with_any_port(plan_.listen), ::bind, "listen on"));
  ++report_.to_operator.address_changes;
  return local_address(answers_->descriptor());
}

Time Flow::next_due() const noexcept {
  const Time due = std::min(to_machine_.path.next_due(), to_operator_.path.next_due());
  return due == Time::max() ? due : due + plan_.began_at.time_since_epoch();
}

std::array<int, 2> Flow::descriptors() const noexcept {
  return {upstream_.descriptor(), answers_ ? answers_->descriptor() : -1};
}

FlowReport Flow::report() const {
  FlowReport report = report_;
  report.to_machine.counts = to_machine_.path.counts();
  report.to_operator.counts = to_operator_.path.counts();
  return report;
}

}  // namespace knuckle::relay
