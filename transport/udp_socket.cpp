#include "transport/udp_socket.h"

#include <linux/errqueue.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <utility>

#include "core/error.h"

namespace knuckle {
namespace {

constexpr int kExpedited = 46 << 2;  // DSCP EF (RFC 3246): force and set-points wait for nobody's downloads
constexpr std::uint32_t kWhole = 0xFFFFFFFF;
constexpr std::uint32_t kPayloadAt = 8;  // a socket's filter sees the UDP header first

sock_filter load(std::uint16_t size, std::uint32_t at) noexcept {
  return BPF_STMT(static_cast<std::uint16_t>(BPF_LD | size | BPF_ABS), at);
}

/// Passes a datagram for which all comparisons of any chain hold; drops others.
class Filter {
 public:
  struct Comparison {
    std::uint16_t size;
    std::uint32_t at, value;
  };
  void add_chain(std::span<const Comparison> chain) noexcept {
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const auto past = static_cast<std::uint8_t>(2 * (chain.size() - 1 - i) + 1);  // over the rest, and "pass"
      add(load(chain[i].size, chain[i].at));
      add(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, chain[i].value, 0, past));
    }
    add(BPF_STMT(BPF_RET | BPF_K, kWhole));
  }
  void attach_to(int socket) noexcept {
    add(BPF_STMT(BPF_RET | BPF_K, 0));
    const sock_fprog filter{static_cast<unsigned short>(count_), steps_.data()};
    (void)::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter);
  }

 private:
  void add(const sock_filter& step) noexcept { steps_[count_++] = step; }
  std::array<sock_filter, 5 * UdpSocket::kMostBeginnings + 1> steps_{};
  std::size_t count_ = 0;
};

std::uint32_t big_endian(const void* bytes) noexcept {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes, sizeof value);
  return ntohl(value);
}

}  // namespace

UdpSocket::UdpSocket(int descriptor) noexcept : descriptor_(descriptor) {
  const int on = 1, mark = kExpedited;
  (void)::setsockopt(descriptor_.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  (void)::setsockopt(descriptor_.get(), IPPROTO_IP, IP_TOS, &mark, sizeof mark);
  (void)::setsockopt(descriptor_.get(), IPPROTO_IPV6, IPV6_TCLASS, &mark, sizeof mark);
}

int UdpSocket::send(std::span<const std::uint8_t> bytes, const SocketAddress& to) const noexcept {
  const ssize_t sent =
      ::sendto(descriptor_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL, to.size == 0 ? nullptr : to.get(), to.size);
  if (sent == static_cast<ssize_t>(bytes.size())) return 0;
  return sent < 0 ? errno : EMSGSIZE;
}

std::optional<UdpSocket::Arrival> UdpSocket::receive(std::span<std::uint8_t> bytes,
                                                     SocketAddress& from) const noexcept {
  iovec part{bytes.data(), bytes.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> control;
  msghdr header{};
  header.msg_name = &from.bytes;
  header.msg_namelen = sizeof from.bytes;
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  const ssize_t got = ::recvmsg(descriptor_.get(), &header, MSG_TRUNC);
  if (got < 0) return std::nullopt;
  from.size = header.msg_namelen;
  Arrival arrival{static_cast<std::size_t>(got), {}};
  const cmsghdr* stamp = CMSG_FIRSTHDR(&header);
  if (stamp == nullptr || stamp->cmsg_level != SOL_SOCKET || stamp->cmsg_type != SO_TIMESTAMPNS) return arrival;
  timespec came{}, now{};
  std::memcpy(&came, CMSG_DATA(stamp), sizeof came);
  ::clock_gettime(CLOCK_REALTIME, &now);
  const Duration waited = std::chrono::seconds(now.tv_sec - came.tv_sec) + Duration(now.tv_nsec - came.tv_nsec);
  arrival.waited = std::max(Duration::zero(), waited);  // the computer's clock may be set back meanwhile
  return arrival;
}

void UdpSocket::hear_refusals(bool on) const noexcept {
  const int value = on ? 1 : 0;
  (void)::setsockopt(descriptor_.get(), IPPROTO_IP, IP_RECVERR, &value, sizeof value);
  (void)::setsockopt(descriptor_.get(), IPPROTO_IPV6, IPV6_RECVERR, &value, sizeof value);
}

std::optional<SocketAddress> UdpSocket::next_refusal() const noexcept {
  for (;;) {
    SocketAddress to;
    alignas(cmsghdr) std::array<char, 512> control;
    msghdr header{};
    header.msg_name = &to.bytes;
    header.msg_namelen = sizeof to.bytes;
    header.msg_control = control.data();
    header.msg_controllen = control.size();
    if (::recvmsg(descriptor_.get(), &header, MSG_ERRQUEUE) < 0) return std::nullopt;
    to.size = header.msg_namelen;
    for (const cmsghdr* one = CMSG_FIRSTHDR(&header); one != nullptr;
         one = CMSG_NXTHDR(&header, const_cast<cmsghdr*>(one))) {
      const bool four = one->cmsg_level == IPPROTO_IP && one->cmsg_type == IP_RECVERR;
      const bool six = one->cmsg_level == IPPROTO_IPV6 && one->cmsg_type == IPV6_RECVERR;
      if (!four && !six) continue;
      sock_extended_err error{};
      std::memcpy(&error, CMSG_DATA(one), sizeof error);
      if (error.ee_errno == ECONNREFUSED) return to;
    }
  }
}

void UdpSocket::hear_only_from(const SocketAddress& source) const noexcept {
  constexpr auto kNetwork = static_cast<std::uint32_t>(SKF_NET_OFF);
  std::array<Filter::Comparison, 5> chain{{{BPF_H, 0, source.port()}}};
  std::size_t count = 1;
  const auto& six = reinterpret_cast<const sockaddr_in6&>(source.bytes).sin6_addr;
  if (source.bytes.ss_family == AF_INET) {
    const auto& four = reinterpret_cast<const sockaddr_in&>(source.bytes);
    chain[count++] = {BPF_W, kNetwork + 12, ntohl(four.sin_addr.s_addr)};
  } else if (IN6_IS_ADDR_V4MAPPED(&six)) {  // on a socket of both families: the packet itself is IPv4
    chain[count++] = {BPF_W, kNetwork + 12, big_endian(six.s6_addr + 12)};
  } else {
    for (std::uint32_t i = 0; i < 16; i += 4) chain[count++] = {BPF_W, kNetwork + 8 + i, big_endian(six.s6_addr + i)};
  }
  Filter filter;
  filter.add_chain(std::span(chain).first(count));
  filter.attach_to(descriptor_.get());
}

void UdpSocket::hear_only_beginning_with(std::span<const std::array<std::uint8_t, 8>> beginnings) const noexcept {
  Filter filter;
  for (const auto& beginning : beginnings.first(std::min(beginnings.size(), kMostBeginnings))) {
    const std::array<Filter::Comparison, 2> chain{
        {{BPF_W, kPayloadAt, big_endian(beginning.data())}, {BPF_W, kPayloadAt + 4, big_endian(beginning.data() + 4)}}};
    filter.add_chain(chain);
  }
  filter.attach_to(descriptor_.get());
}

void UdpSocket::hear_all() const noexcept {
  const int unused = 0;
  (void)::setsockopt(descriptor_.get(), SOL_SOCKET, SO_DETACH_FILTER, &unused, sizeof unused);
}

SocketPair open_socket_pair(const std::string& name, const SocketAddress& address, std::uint8_t mark) {
  const auto refuse = [&name] {
    throw InputError("link: cannot share the port of " + name + ": " + std::strerror(errno));
  };
  SocketPair pair;
  // Bound alone first: a port that another program has is refused. Only then may the second one share it.
  pair.marked = UdpSocket(open_udp_socket(name, address, ::bind, "listen on"));
  const SocketAddress bound = local_address(pair.marked.descriptor());
  const int on = 1;
  if (::setsockopt(pair.marked.descriptor(), SOL_SOCKET, SO_REUSEPORT, &on, sizeof on) != 0) refuse();
  const int second = ::socket(bound.bytes.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (second < 0) refuse();
  pair.unmarked = UdpSocket(second);
  if (::setsockopt(second, SOL_SOCKET, SO_REUSEPORT, &on, sizeof on) != 0 ||
      ::bind(second, bound.get(), bound.size) != 0)
    refuse();
  // Sees the payload; says which socket of the port, in the order of binding.
  std::array<sock_filter, 4> choose{load(BPF_B, 0), BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, mark, 0, 1),
                                    BPF_STMT(BPF_RET | BPF_K, 0), BPF_STMT(BPF_RET | BPF_K, 1)};
  const sock_fprog program{choose.size(), choose.data()};
  if (::setsockopt(second, SOL_SOCKET, SO_ATTACH_REUSEPORT_CBPF, &program, sizeof program) != 0) refuse();
  return pair;
}

}  // namespace knuckle
