#include "transport/ice/network_watch.h"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>

#include <array>
#include <utility>

namespace knuckle::ice {

NetworkWatch::NetworkWatch(GMainContext* context, std::function<void()> changed) {
  const int socket = ::socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (socket < 0) return;
  socket_ = UdpSocket(socket);
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = RTMGRP_IPV4_IFADDR | RTMGRP_IPV6_IFADDR | RTMGRP_LINK;
  if (::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return;
  readable_ = GlibSource::readable(context, socket, [socket, changed = std::move(changed)] {
    std::array<char, 8192> message;
    while (::recv(socket, message.data(), message.size(), MSG_DONTWAIT) > 0) {
    }
    changed();
  });
}

}  // namespace knuckle::ice
