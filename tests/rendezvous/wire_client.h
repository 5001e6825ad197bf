// A client of a rendezvous in a test's hand: says what the test wants, also what no program would.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>

#include "transport/socket_address.h"

namespace knuckle::test {

class WireClient {
 public:
  explicit WireClient(const SocketAddress& address, int receive_bytes = 0)
      : socket_(::socket(address.bytes.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (receive_bytes > 0) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
    EXPECT_EQ(::connect(socket_, address.get(), address.size), 0);
  }
  ~WireClient() { ::close(socket_); }
  WireClient(const WireClient&) = delete;
  WireClient& operator=(const WireClient&) = delete;

  void say(const std::string& line) { raw(line + "\n"); }
  void raw(const std::string& bytes) { (void)::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT); }
  /// All that has come by now, without waiting.
  std::string heard() {
    std::array<char, 65536> bytes;
    for (;;) {
      const ssize_t got = ::recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
      if (got == 0 || (got < 0 && errno != EAGAIN)) ended_ = true;
      if (got <= 0) return heard_;
      heard_.append(bytes.data(), static_cast<std::size_t>(got));
    }
  }
  [[nodiscard]] bool says(const std::string& what) { return heard().find(what) != std::string::npos; }
  [[nodiscard]] bool ended() {
    (void)heard();
    return ended_;
  }

 private:
  int socket_;
  std::string heard_;
  bool ended_ = false;
};

}  // namespace knuckle::test
