#include "transport/ice/server_name.h"

#include <gio/gio.h>

#include <utility>

namespace knuckle::ice {
namespace {

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

}  // namespace

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

}  // namespace knuckle::ice
