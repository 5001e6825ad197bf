#include "transport/ice/dialler.h"

#include <fcntl.h>
#include <gio/gio.h>
#include <glib.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/text.h"
#include "transport/ice/glib_source.h"
#include "transport/ice/rendezvous_client.h"
#include "transport/socket_address.h"
#include "transport/udp_socket.h"

namespace knuckle::ice {
namespace {

// Addresses of a server that is given by name, looked up beside everything else in the thread of a GLib loop. libnice
// 0.1.21 looks names up as well, but then sends to port 0 of a TURN server.

class ServerName {
 public:
  using Clock = std::chrono::steady_clock;

  explicit ServerName(HostAndPort server);
  ~ServerName();
  ServerName(const ServerName&) = delete;
  ServerName& operator=(const ServerName&) = delete;

  /// Often: looks it up where that has not succeeded yet. The thread's own context has to be the loop's.
  void tend(Clock::time_point now);
  /// The network may have changed: looks it up again. What is known stays until there is an answer.
  void doubt() noexcept { known_ = false; }
  /// Has been looked up once, whatever came of it.
  bool tried() const noexcept { return tried_; }
  /// As known last, best first.
  const std::vector<SocketAddress>& addresses() const noexcept { return addresses_; }
  const HostAndPort& server() const noexcept { return server_; }

 private:
  struct LookUp;
  const HostAndPort server_;
  std::vector<SocketAddress> addresses_;
  std::shared_ptr<LookUp> under_way_;
  Clock::time_point again_at_{};
  bool known_ = false, tried_ = false;
};

using namespace std::chrono_literals;

constexpr auto kAgain = 5000ms;
constexpr std::size_t kMostAddresses = 4;

SocketAddress with_port(GInetAddress* host, std::uint16_t port) {
  GSocketAddress* address = g_inet_socket_address_new(host, port);
  SocketAddress result;
  const gssize size = g_socket_address_get_native_size(address);
  if (size > 0 && g_socket_address_to_native(address, &result.bytes, sizeof result.bytes, nullptr))
    result.size = static_cast<socklen_t>(size);
  g_object_unref(address);
  return result;
}

/// One that is under way may still find who asked, or nobody.
struct ServerName::LookUp {
  ServerName* name;
  GCancellable* cancel = g_cancellable_new();
  explicit LookUp(ServerName* whose) : name(whose) {}
  ~LookUp() { g_object_unref(cancel); }
  LookUp(const LookUp&) = delete;
  LookUp& operator=(const LookUp&) = delete;

  static void done(GObject* resolver, GAsyncResult* result, gpointer data) {
    const std::unique_ptr<std::shared_ptr<LookUp>> held(static_cast<std::shared_ptr<LookUp>*>(data));
    GList* found = g_resolver_lookup_by_name_finish(G_RESOLVER(resolver), result, nullptr);
    if (ServerName* name = (*held)->name; name != nullptr) {
      name->under_way_.reset();
      name->tried_ = true;
      std::vector<SocketAddress> addresses;
      for (const GList* at = found; at != nullptr && addresses.size() < kMostAddresses; at = at->next)
        addresses.push_back(with_port(G_INET_ADDRESS(at->data), name->server_.port));
      name->known_ = !addresses.empty();
      if (name->known_) name->addresses_ = std::move(addresses);
    }
    g_resolver_free_addresses(found);
  }
};

ServerName::ServerName(HostAndPort server) : server_(std::move(server)) {}

ServerName::~ServerName() {
  if (!under_way_) return;
  under_way_->name = nullptr;
  g_cancellable_cancel(under_way_->cancel);
}

void ServerName::tend(Clock::time_point now) {
  if (known_ || under_way_ || now < again_at_) return;
  again_at_ = now + kAgain;
  under_way_ = std::make_shared<LookUp>(this);
  GResolver* resolver = g_resolver_get_default();
  g_resolver_lookup_by_name_async(resolver, server_.host.c_str(), under_way_->cancel, LookUp::done,
                                  new std::shared_ptr<LookUp>(under_way_));
  g_object_unref(resolver);
}

// Tells when addresses or links of this computer change (Linux, rtnetlink).

class NetworkWatch {
 public:
  /// Where the system does not tell, nothing is ever called: a path that fails is noticed all the same.
  NetworkWatch(GMainContext* context, std::function<void()> changed);

 private:
  UdpSocket socket_;
  GlibSource readable_;
};

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

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kTendEvery = 20ms;
constexpr auto kNetworkSettles = 200ms;  // changes of the network come in bursts
constexpr auto kCloseWithin = 300ms;     // what a relay has allocated is released
constexpr auto kServersKnown = 3000ms;   // looking their names up takes no longer, or is in vain for now
constexpr auto kLookForExpired = 1000ms;
constexpr std::size_t kMostEvents = 256;

bool is_loopback(const std::string& host) {
  return host == "localhost" || host == "::1" || host.rfind("127.", 0) == 0;
}

UdpSocket connected(const SocketAddress& to) {
  return UdpSocket(open_udp_socket(text(to), to, ::connect, "reach"));
}

/// By a descriptor of its own. @throws InputError where none is left.
UdpSocket same(const UdpSocket& socket) {
  const int descriptor = ::fcntl(socket.descriptor(), F_DUPFD_CLOEXEC, 0);
  if (descriptor < 0) throw InputError(std::string("link: ") + std::strerror(errno));
  return UdpSocket(descriptor);
}

bool admitted(const secure::Peer& peer) {
  return !peer.revoked && (peer.expires_utc.empty() || utc_text(std::time(nullptr)) < peer.expires_utc);
}

}  // namespace

/// All that lives in the loop's thread.
class Dialler::Thread final : RendezvousClient::Listener {
 public:
  Thread(Dialler& dialler, GMainContext* context)
      : dialler_(dialler),
        context_(context),
        network_(context, [this] { change_at_ = std::min(change_at_, Clock::now() + kNetworkSettles); }) {
    if (const auto& server = dialler.setup_.servers.stun) stun_.emplace(*server);
    if (const auto& server = dialler.setup_.servers.turn) turn_.emplace(*server);
    Listener& self = *this;
    rendezvous_ = std::make_unique<RendezvousClient>(context, dialler.setup_.rendezvous, self);
    timer_ = GlibSource::every(context, kTendEvery, [this] { tend(); });
  }

 private:
  /// With the addresses that the servers have now.
  [[nodiscard]] AgentSetup agent_now(bool direct_only) const {
    const Servers& servers = dialler_.setup_.servers;
    AgentSetup setup;
    setup.loopback = is_loopback(parse_host_and_port(dialler_.setup_.rendezvous).host);
    setup.turn_user = servers.turn_user;
    setup.turn_password = servers.turn_password;
    if (turn_ && !direct_only) setup.turn = turn_->addresses();
    // Where the TURN server is not to relay, it still tells the address outside a NAT.
    const std::optional<ServerName>& asked = stun_ || !direct_only ? stun_ : turn_;
    for (const SocketAddress& one : asked ? asked->addresses() : std::vector<SocketAddress>{}) {
      // One alone may be asked: of IPv4 where it has one, since NATs are found there.
      if (!setup.stun || (setup.stun->bytes.ss_family != AF_INET && one.bytes.ss_family == AF_INET)) setup.stun = one;
    }
    return setup;
  }

  [[nodiscard]] std::unique_ptr<Path> path_to(const secure::Peer& peer, const std::string& room) {
    Path::Setup setup{.context = context_,
                      .role = dialler_.setup_.role,
                      .agent = [this](bool direct_only) { return agent_now(direct_only); },
                      .relay = dialler_.setup_.servers.turn ? dialler_.setup_.servers.turn->host : "",
                      .far_end = peer,
                      .signal = [this, room](const Bytes& bytes) { rendezvous_->send(room, bytes); },
                      .report = [this](const PathEvent& event) { report(event); },
                      .wake = [this] { wake(); }};
    UdpSocket socket = operates() ? same(dialler_.inner_) : connected(dialler_.link_);
    return std::make_unique<Path>(std::move(setup), dialler_.signer_, std::move(socket));
  }

  /// A path to each far end that is admitted now, and to nobody else.
  void follow_peers() {
    std::vector<std::string> rooms;
    for (const secure::Peer& peer : dialler_.peers()) {
      if (!admitted(peer) || rooms.size() == kMostRooms) continue;
      const std::string room = room_of(dialler_.signer_.fingerprint(), peer.fingerprint);
      try {
        if (!paths_.contains(room)) paths_.emplace(room, path_to(peer, room));
      } catch (const InputError&) {
        continue;  // no descriptor was left: again in a second
      }
      rooms.push_back(room);
    }
    std::erase_if(paths_,
                  [&](const auto& one) { return std::find(rooms.begin(), rooms.end(), one.first) == rooms.end(); });
    if (rooms == rooms_) return;
    if (first_.empty()) first_ = rooms.front();
    rooms_ = std::move(rooms);
    rendezvous_->set_rooms(rooms_);
  }

  [[nodiscard]] bool operates() const { return dialler_.setup_.role == secure::Role::kOperator; }
  void somebody_in(const std::string& room) override { paths_.at(room)->somebody_there(Clock::now()); }
  void message(const std::string& room, const Bytes& bytes) override { paths_.at(room)->hear(bytes, Clock::now()); }

  /// In this turn of the loop, but not inside whoever called.
  void wake() {
    if (woken_) return;
    woken_ = true;
    soon_ = GlibSource::soon(context_, [this] {
      woken_ = false;
      tend();
    });
  }

  void tend() {
    const auto now = Clock::now();
    if (dialler_.peers_changed_.exchange(false) || now >= follow_at_) {
      follow_at_ = now + kLookForExpired;
      follow_peers();
    }
    bool servers_known = true;
    for (ServerName* one : {stun_ ? &*stun_ : nullptr, turn_ ? &*turn_ : nullptr}) {
      if (one == nullptr) continue;
      one->tend(now);
      servers_known = servers_known && one->tried();
    }
    // Nobody is met before: a first attempt without the relay would be in vain.
    if (servers_known || now > started_ + kServersKnown) rendezvous_->tend(now);
    if (now >= change_at_) {
      change_at_ = Clock::time_point::max();
      rendezvous_->doubt(now);
      if (stun_) stun_->doubt();
      if (turn_) turn_->doubt();
      for (const auto& [room, path] : paths_) path->network_changed(now);
    }
    for (const auto& [room, path] : paths_) path->tend(now);
    tell();
  }

  void report(const PathEvent& event) {
    if (event.kind == PathEvent::Kind::kLost) rendezvous_->doubt(event.at);
    const std::lock_guard lock(dialler_.mutex_);
    if (dialler_.events_.size() < kMostEvents) dialler_.events_.push_back(event);
    if (event.kind == PathEvent::Kind::kInUse && dialler_.pairs_.size() < kMostEvents) dialler_.pairs_.push_back(event);
  }

  void tell() {
    std::string problem = rendezvous_->problem();
    const bool carried =
        std::any_of(paths_.begin(), paths_.end(), [](const auto& one) { return one.second->carries(); });
    const auto found = paths_.find(first_);
    const Path* first = found != paths_.end() ? found->second.get() : nullptr;
    if (carried && !problem.empty())
      problem += "; the path in use goes on, no other can be found";
    else if (!carried && problem.empty() && operates() && first == nullptr)
      problem = "no path: the far end's pairing was revoked here, or has expired (knuckle pair)";
    else if (!carried && problem.empty() && operates())
      problem = first->knows_far_end() ? "no path to " + first->far_end() + " yet"
                                       : first->far_end() + " is not at the rendezvous " + dialler_.setup_.rendezvous;
    const std::lock_guard lock(dialler_.mutex_);
    dialler_.problem_ = std::move(problem);
    if (first != nullptr) dialler_.round_trips_ = first->round_trips();
  }

  Dialler& dialler_;
  GMainContext* context_;
  const Clock::time_point started_ = Clock::now();
  std::optional<ServerName> stun_, turn_;
  std::unique_ptr<RendezvousClient> rendezvous_;
  std::map<std::string, std::unique_ptr<Path>> paths_;  // by room
  std::vector<std::string> rooms_;
  std::string first_;  // room of the first far end that was admitted
  NetworkWatch network_;
  Clock::time_point change_at_ = Clock::time_point::max(), follow_at_{};
  GlibSource timer_, soon_;
  bool woken_ = false;
};

Dialler::Dialler(const DialSetup& setup, const secure::Identity& identity, const secure::Peers& peers)
    : setup_(setup), signer_(identity), peers_(peers) {
  (void)parse_host_and_port(setup.rendezvous);
  const std::string any = "127.0.0.1:0";
  inner_ = UdpSocket(open_udp_socket(any, parse_address(any), ::bind, "listen on"));
  inner_address_ = text(local_address(inner_.descriptor()));
}

std::string Dialler::address() const {
  return inner_address_;
}

void Dialler::start(const SocketAddress& link) {
  link_ = link;
  if (setup_.role == secure::Role::kOperator)
    (void)::connect(inner_.descriptor(), link.get(), link.size);  // nobody else on this computer is heard
  thread_ = std::thread([this] {
    GMainContext* context = g_main_context_new();
    g_main_context_push_thread_default(context);
    {
      Thread thread(*this, context);
      while (!ending_.load(std::memory_order_relaxed)) g_main_context_iteration(context, TRUE);
    }
    const auto give_up = Clock::now() + kCloseWithin;
    const GlibSource ticks = GlibSource::every(context, kTendEvery, [] {});
    while (closing_agents() > 0 && Clock::now() < give_up) g_main_context_iteration(context, TRUE);
    g_main_context_pop_thread_default(context);
    g_main_context_unref(context);
  });
}

Dialler::~Dialler() {
  ending_.store(true, std::memory_order_relaxed);
  if (thread_.joinable()) thread_.join();
}

void Dialler::set_peers(secure::Peers peers) {
  const std::lock_guard lock(mutex_);
  peers_ = std::move(peers);
  peers_changed_ = true;
}

secure::Peers Dialler::peers() const {
  const std::lock_guard lock(mutex_);
  return peers_;
}

std::vector<PathEvent> Dialler::take_events() {
  const std::lock_guard lock(mutex_);
  return std::exchange(events_, {});
}

std::string Dialler::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

std::vector<PathEvent> Dialler::pairs() const {
  const std::lock_guard lock(mutex_);
  return pairs_;
}

Histogram Dialler::round_trips() const {
  const std::lock_guard lock(mutex_);
  return round_trips_;
}

}  // namespace knuckle::ice
