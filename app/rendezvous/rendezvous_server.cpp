#include "app/rendezvous/rendezvous_server.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <iostream>

#include "app/cli/interrupt.h"
#include "core/error.h"

namespace knuckle::rendezvous {

namespace {

constexpr auto kLookForIdle = std::chrono::milliseconds(250);
constexpr int kBacklog = 64, kMostAccepts = 64;
constexpr std::size_t kChunk = 8192;

Descriptor open_listener(const std::string& name) {
  const SocketAddress address = parse_address(name, "--listen");
  Descriptor socket(::socket(address.bytes.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  if (socket) (void)::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (!socket || ::bind(socket.get(), address.get(), address.size) != 0 || ::listen(socket.get(), kBacklog) != 0) {
    const std::string why = why_not_bound(errno);
    throw InputError("--listen " + name + ": " + why);
  }
  return socket;
}

/// As many as this program may have open, beside what is open already and a few to turn others away with: without a
/// descriptor left a connection cannot even be refused, and waits at the listening socket for ever.
std::size_t most_clients(std::size_t wanted, int newest_descriptor) {
  constexpr std::size_t kSpare = 8;
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) != 0) return wanted;
  const std::size_t taken = static_cast<std::size_t>(newest_descriptor) + 1 + kSpare;
  return std::min<std::size_t>(wanted, files.rlim_cur > taken ? files.rlim_cur - taken : 1);
}

}  // namespace

std::string network_of(const SocketAddress& address) {
  const auto bytes = [](const void* begin, std::size_t count) {
    return std::string(static_cast<const char*>(begin), count);
  };
  if (address.bytes.ss_family != AF_INET6)
    return bytes(&reinterpret_cast<const sockaddr_in&>(address.bytes).sin_addr, 4);
  const in6_addr& six = reinterpret_cast<const sockaddr_in6&>(address.bytes).sin6_addr;
  return IN6_IS_ADDR_V4MAPPED(&six) ? bytes(&six.s6_addr[12], 4) : bytes(&six.s6_addr[0], 8);
}

RendezvousServer::RendezvousServer(const std::string& address, const Bounds& bounds)
    : bounds_(bounds), listening_(open_listener(address)), events_(::epoll_create1(EPOLL_CLOEXEC)) {
  epoll_event wanted{EPOLLIN, {.fd = listening_.get()}};
  if (!events_ || ::epoll_ctl(events_.get(), EPOLL_CTL_ADD, listening_.get(), &wanted) != 0)
    throw InputError(std::string("rendezvous: ") + std::strerror(errno));
  bounds_.clients = most_clients(bounds_.clients, std::max(listening_.get(), events_.get()));
}

void RendezvousServer::step(std::chrono::milliseconds longest, Clock::time_point now) {
  std::array<epoll_event, 64> happened{};
  const int count = ::epoll_wait(events_.get(), happened.data(), happened.size(), static_cast<int>(longest.count()));
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = happened[static_cast<std::size_t>(i)];
    if (event.data.fd == listening_.get()) {
      accept_all(now);
      continue;
    }
    const auto found = clients_.find(event.data.fd);
    if (found == clients_.end()) continue;
    Client& client = *found->second;
    if ((event.events & EPOLLOUT) != 0) write(client);
    if ((event.events & (EPOLLIN | EPOLLHUP | EPOLLERR)) != 0) read(client, now);
  }
  end_idle(now);
  bury();
}

void RendezvousServer::accept_all(Clock::time_point now) {
  for (int i = 0; i < kMostAccepts; ++i) {
    SocketAddress from;
    from.size = sizeof from.bytes;
    Descriptor socket(::accept4(listening_.get(), from.get(), &from.size, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!socket) return;
    const std::string network = network_of(from);
    const auto same = static_cast<std::size_t>(std::count_if(
        clients_.begin(), clients_.end(), [&](const auto& one) { return one.second->network == network; }));
    if (clients_.size() >= bounds_.clients || same >= bounds_.clients_of_network) {
      ++counters_.turned_away;
      continue;
    }
    const int on = 1;
    (void)::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    auto client = std::make_unique<Client>();
    const int number = socket.get();
    client->socket = std::move(socket);
    client->network = network;
    client->lines = bounds_.burst;
    client->heard_at = client->refilled_at = now;
    watch(*client, EPOLL_CTL_ADD);
    clients_.emplace(number, std::move(client));
    ++counters_.accepted;
  }
}

void RendezvousServer::watch(const Client& client, int operation) const {
  epoll_event wanted{EPOLLIN, {.fd = client.socket.get()}};
  if (!client.out.empty()) wanted.events |= EPOLLOUT;
  (void)::epoll_ctl(events_.get(), operation, client.socket.get(), &wanted);
}

/// One chunk at a time: whoever sends most waits for all others' turns.
void RendezvousServer::read(Client& client, Clock::time_point now) {
  if (client.ending) return;
  std::array<char, kChunk> bytes;
  const ssize_t got = ::recv(client.socket.get(), bytes.data(), bytes.size(), 0);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (got <= 0) {
    client.ending = true;
    return;
  }
  const bool fits = client.in.add({bytes.data(), static_cast<std::size_t>(got)});
  while (!client.ending) {
    const auto line = client.in.next();
    if (!line) break;
    if (!may_talk(client, now)) return refuse(client, counters_.floods, "too many lines");
    obey(client, *line);
    if (!client.rooms.empty()) client.heard_at = now;  // words alone keep nobody here
  }
  if (!fits && !client.ending) refuse(client, counters_.junk, "line too long");
}

bool RendezvousServer::may_talk(Client& client, Clock::time_point now) const {
  const double passed_s = std::chrono::duration<double>(now - client.refilled_at).count();
  client.refilled_at = now;
  client.lines = std::min(bounds_.burst, client.lines + passed_s * bounds_.lines_per_s);
  client.lines -= 1;
  return client.lines >= 0;
}

void RendezvousServer::obey(Client& client, std::string_view line) {
  const auto request = ice::parse_request(line);
  if (!request) return refuse(client, counters_.junk, "not a line of this protocol");
  if (request->verb == "ping") return say(client, "pong");
  const std::string room(request->room);
  const bool inside = std::find(client.rooms.begin(), client.rooms.end(), room) != client.rooms.end();
  if (request->verb == "join") {
    if (!inside && client.rooms.size() >= bounds_.rooms_of_client)
      return refuse(client, counters_.junk, "too many rooms");
    if (!inside) join(client, room);
    return;
  }
  if (!inside) return refuse(client, counters_.junk, "not in this room");
  const std::string message = "message " + room + " " + std::string(request->rest);
  for (Client* other : std::vector<Client*>(rooms_[room])) {
    if (other == &client || other->ending) continue;
    ++counters_.passed;
    say(*other, message);
  }
}

void RendezvousServer::join(Client& client, const std::string& room) {
  std::vector<Client*>& members = rooms_[room];
  std::erase_if(members, [](const Client* one) { return one->ending; });
  if (members.size() >= bounds_.members) {
    Client* longest = *std::min_element(members.begin(), members.end(),
                                        [](const Client* a, const Client* b) { return a->heard_at < b->heard_at; });
    std::erase(members, longest);
    refuse(*longest, counters_.displaced, "room is full, others are heard more recently");
  }
  for (Client* other : members) say(*other, "entered " + room);
  say(client, "joined " + room + " " + std::to_string(members.size()));
  members.push_back(&client);
  client.rooms.push_back(room);
}

void RendezvousServer::say(Client& client, std::string_view line) {
  if (client.ending) return;
  if (client.out.size() + line.size() >= bounds_.unread_bytes) {
    ++counters_.stalled;
    client.ending = true;
    return;
  }
  client.out.append(line).push_back('\n');
  write(client);
}

void RendezvousServer::write(Client& client) {
  if (client.ending || client.out.empty()) return;
  const ssize_t sent = ::send(client.socket.get(), client.out.data(), client.out.size(), MSG_NOSIGNAL);
  if (sent < 0 && errno != EAGAIN && errno != EINTR) {
    client.ending = true;
    return;
  }
  if (sent > 0) client.out.erase(0, static_cast<std::size_t>(sent));
  watch(client, EPOLL_CTL_MOD);
}

/// Told why, as far as that goes through at once.
void RendezvousServer::refuse(Client& client, std::uint64_t& counter, std::string_view why) {
  ++counter;
  say(client, "refused " + std::string(why));
  client.ending = true;
}

void RendezvousServer::end_idle(Clock::time_point now) {
  if (now - looked_at_ < std::min(kLookForIdle, bounds_.first)) return;
  looked_at_ = now;
  for (const auto& [socket, client] : clients_) {
    if (client->ending || now - client->heard_at < (client->rooms.empty() ? bounds_.first : bounds_.idle)) continue;
    refuse(*client, counters_.idle, "silent for too long");
  }
}

void RendezvousServer::bury() {
  std::erase_if(clients_, [this](const auto& entry) {
    const Client& client = *entry.second;
    if (!client.ending) return false;
    for (const std::string& room : client.rooms) {
      const auto found = rooms_.find(room);
      if (found == rooms_.end()) continue;
      std::erase(found->second, &client);
      if (found->second.empty()) rooms_.erase(found);
    }
    return true;
  });
}

namespace {

constexpr std::chrono::milliseconds kLongestWait{200};

int run(const std::string& listen) {
  const cli::InterruptGuard interrupt;
  RendezvousServer server(listen);
  std::cerr << "knuckle rendezvous: listening on " << text(server.address()) << std::endl;
  while (!interrupt.pending()) server.step(kLongestWait);
  const Counters& c = server.counters();
  std::cerr << "knuckle rendezvous: stopped: " << c.accepted << " connections, " << c.passed
            << " messages passed on; ended for junk " << c.junk << ", flooding " << c.floods << ", not reading "
            << c.stalled << ", silence " << c.idle << ", a full room " << c.displaced << "; turned away "
            << c.turned_away << '\n';
  return 0;
}

}  // namespace

cli::Command rendezvous_entry() {
  return cli::command<std::string>(
      "rendezvous", "Where two sides behind NAT find each other: passes their signed messages on (docs/network.md)",
      [](const cli::OptionList& command, std::string& listen) {
        command.add_option("--listen", listen, "Address and TCP port, such as 0.0.0.0:5684 or [::]:5684").required();
      },
      run);
}

}  // namespace knuckle::rendezvous
