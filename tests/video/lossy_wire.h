// A network between two UDP ports of this computer that loses datagrams, or all of them, delays them, or meddles.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "core/time.h"

namespace knuckle::video {

class LossyWire {
 public:
  using Bytes = std::vector<std::uint8_t>;
  /// @param to a port of this computer. @param loss share of the datagrams. @param meddle may change what passes; in
  /// the wire's thread.
  LossyWire(std::uint16_t to, double loss, Duration delay = {}, std::function<void(Bytes&)> meddle = {})
      : to_(to), loss_(loss), delay_(delay), meddle_(std::move(meddle)) {
    sockaddr_in here = address(0);
    socklen_t size = sizeof here;
    if (socket_ < 0 || bind(socket_, reinterpret_cast<sockaddr*>(&here), size) != 0 ||
        getsockname(socket_, reinterpret_cast<sockaddr*>(&here), &size) != 0)
      throw std::runtime_error("no UDP socket");
    port_ = ntohs(here.sin_port);
    thread_ = std::thread([this] { run(); });
  }
  ~LossyWire() {
    ending_ = true;
    thread_.join();
    close(socket_);
  }
  LossyWire(const LossyWire&) = delete;
  LossyWire& operator=(const LossyWire&) = delete;

  /// Where to send to.
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  void set_cut(bool cut) noexcept { cut_ = cut; }
  /// Any thread: as if it had been sent by whoever may send to the far end.
  void inject(const Bytes& bytes) const noexcept {
    const sockaddr_in there = address(to_);
    sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&there), sizeof there);
  }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Of the datagram received last: its DSCP, 0 to 63.
  [[nodiscard]] int dscp() const noexcept { return dscp_; }

 private:
  using Clock = std::chrono::steady_clock;
  static sockaddr_in address(std::uint16_t port) {
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_port = htons(port);
    a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return a;
  }
  void run() {
    const int on = 1;
    setsockopt(socket_, IPPROTO_IP, IP_RECVTOS, &on, sizeof on);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> share(0, 1);
    std::array<std::uint8_t, 2048> bytes{};
    std::deque<std::pair<Clock::time_point, Bytes>> travelling;
    std::array<char, 64> control{};
    for (pollfd wait{socket_, POLLIN, 0}; !ending_;) {
      const bool arrived = poll(&wait, 1, delay_ > Duration{} ? 1 : 20) == 1;
      for (; !travelling.empty() && travelling.front().first <= Clock::now(); travelling.pop_front())
        inject(travelling.front().second);
      if (!arrived) continue;
      iovec part{bytes.data(), bytes.size()};
      msghdr message{};
      message.msg_iov = &part;
      message.msg_iovlen = 1;
      message.msg_control = control.data();
      message.msg_controllen = control.size();
      const ssize_t length = recvmsg(socket_, &message, 0);
      if (length < 0) continue;
      for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c))
        if (c->cmsg_level == IPPROTO_IP && c->cmsg_type == IP_TOS) dscp_ = *CMSG_DATA(c) >> 2;
      if (cut_ || share(random) < loss_) {
        ++lost_;
        continue;
      }
      Bytes passing(bytes.begin(), bytes.begin() + length);
      if (meddle_) meddle_(passing);
      if (delay_ > Duration{})
        travelling.emplace_back(Clock::now() + delay_, std::move(passing));
      else
        inject(passing);
    }
  }

  const int socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const std::uint16_t to_;
  const double loss_;
  const Duration delay_;
  const std::function<void(Bytes&)> meddle_;
  std::uint16_t port_ = 0;
  std::atomic<bool> cut_{false}, ending_{false};
  std::atomic<std::uint64_t> lost_{0};
  std::atomic<int> dscp_{-1};
  std::thread thread_;
};

}  // namespace knuckle::video
