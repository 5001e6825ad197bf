// A rendezvous in a test's hand: it does what `knuckle rendezvous` does, but each line to a client passes through the
// test first, which may change it, repeat it, add to it, hold it back or hang up.
#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "transport/ice/rendezvous_line.h"
#include "transport/socket_address.h"

namespace knuckle::test {

class LyingRendezvous {
 public:
  /// What a client is sent instead of this line (without its end): bytes as they are; an empty text hangs up.
  using Lie = std::function<std::vector<std::string>(const std::string& line)>;

  LyingRendezvous() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const SocketAddress any = parse_address("127.0.0.1:0");
    (void)::bind(listener_, any.get(), any.size);
    (void)::listen(listener_, 16);
    thread_ = std::thread([this] {
      while (!ending_) step();
    });
  }
  ~LyingRendezvous() {
    ending_ = true;
    thread_.join();
    for (const Client& one : clients_) ::close(one.socket);
    ::close(listener_);
  }
  LyingRendezvous(const LyingRendezvous&) = delete;
  LyingRendezvous& operator=(const LyingRendezvous&) = delete;

  [[nodiscard]] std::string address() const { return text(local_address(listener_)); }
  /// From now on; {}: the truth.
  void tell(Lie lie) {
    const std::lock_guard lock(mutex_);
    lie_ = std::move(lie);
  }
  /// Sends these bytes to all clients once, unasked; an empty text hangs up.
  void shout(const std::string& bytes) {
    const std::lock_guard lock(mutex_);
    shouts_.push_back(bytes);
  }
  /// The "message ROOM MESSAGE" lines so far, as they were meant to be passed on.
  [[nodiscard]] std::vector<std::string> messages() {
    const std::lock_guard lock(mutex_);
    return messages_;
  }
  [[nodiscard]] int connections() const { return connections_; }

 private:
  struct Client {
    int socket = -1;
    ice::LineBuffer in;
    std::set<std::string> rooms;
  };

  void step() {
    std::vector<pollfd> all{{listener_, POLLIN, 0}};
    for (const Client& one : clients_) all.push_back({one.socket, POLLIN, 0});
    (void)::poll(all.data(), all.size(), 20);
    for (std::size_t i = 0; i < clients_.size(); ++i) {
      if (all[i + 1].revents != 0) read(clients_[i]);
    }
    if (all[0].revents != 0) accept();
    std::vector<std::string> shouts;
    {
      const std::lock_guard lock(mutex_);
      shouts = std::exchange(shouts_, {});
    }
    for (const std::string& bytes : shouts) {
      for (Client& one : clients_) send(one, bytes);
    }
    std::erase_if(clients_, [](const Client& one) { return one.socket < 0; });
  }
  void accept() {
    Client& one = clients_.emplace_back();
    one.socket = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    const timeval patience{0, 100'000};
    (void)::setsockopt(one.socket, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    ++connections_;
  }
  void read(Client& from) {
    std::array<char, 8192> bytes;
    const ssize_t got = ::recv(from.socket, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (got <= 0) return hang_up(from);
    (void)from.in.add({bytes.data(), static_cast<std::size_t>(got)});
    while (from.socket >= 0) {
      const auto line = from.in.next();
      if (!line) return;
      if (const auto words = ice::parse_request(*line)) obey(from, *words);
    }
  }
  void obey(Client& from, const ice::Line& words) {
    const std::string room(words.room), rest(words.rest);
    if (words.verb == "ping") return say(from, "pong");
    int others = 0;
    for (Client& other : clients_) {
      if (&other == &from || other.socket < 0 || !other.rooms.contains(room)) continue;
      ++others;
      if (words.verb == "join") say(other, "entered " + room);
      if (words.verb != "send") continue;
      const std::string line = "message " + room + " " + rest;
      {
        const std::lock_guard lock(mutex_);
        messages_.push_back(line);
      }
      say(other, line);
    }
    if (words.verb != "join") return;
    from.rooms.insert(room);
    say(from, "joined " + room + " " + std::to_string(others));
  }
  void say(Client& to, const std::string& line) {
    Lie lie;
    {
      const std::lock_guard lock(mutex_);
      lie = lie_;
    }
    for (const std::string& bytes : lie ? lie(line) : std::vector<std::string>{line + "\n"}) send(to, bytes);
  }
  static void send(Client& to, const std::string& bytes) {
    if (to.socket < 0) return;
    if (bytes.empty()) return hang_up(to);
    (void)::send(to.socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  static void hang_up(Client& one) {
    ::close(one.socket);
    one.socket = -1;
  }

  int listener_;
  std::vector<Client> clients_;
  std::mutex mutex_;
  Lie lie_;
  std::vector<std::string> messages_, shouts_;
  std::atomic<int> connections_{0};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

/// What becomes of a "message" line; others pass as they are.
inline LyingRendezvous::Lie of_messages(LyingRendezvous::Lie lie) {
  return [lie = std::move(lie)](const std::string& line) {
    if (line.rfind("message ", 0) != 0) return std::vector<std::string>{line + "\n"};
    return lie(line);
  };
}

/// What no rendezvous should say, and why an end leaves it then.
inline const std::vector<std::pair<std::string, std::string>>& rendezvous_misuses() {
  static const std::vector<std::pair<std::string, std::string>> misuses = [] {
    std::string flood;
    for (int i = 0; i < 300; ++i) flood += "pong\n";
    return std::vector<std::pair<std::string, std::string>>{
        {std::string(100'000, 'x'), "is no rendezvous of Knuckle"},
        {std::string("\0\x16\x03\xFF\n", 5), "is no rendezvous of Knuckle"},
        {"", "has closed the connection"},
        {"refused go away\n", "has refused this computer: go away"},
        {"refused " + std::string(2000, 'w') + "\n", "is no rendezvous of Knuckle"},
        {flood, "sends too much"},
    };
  }();
  return misuses;
}

}  // namespace knuckle::test
