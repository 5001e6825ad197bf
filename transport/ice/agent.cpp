#include "transport/ice/agent.h"

#include <nice/agent.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <stdexcept>

namespace knuckle::ice {
namespace {

constexpr guint kComponent = 1;
constexpr guint kFirstTimeout_ms = 200;  // of a check; libnice doubles it
constexpr gint kExpedited = 46 << 2;     // DSCP EF (RFC 3246), as on every socket of the link
constexpr guint kPacing_ms = 10;         // between checks

thread_local int closing = 0;

NiceAddress nice_address(const SocketAddress& address) {
  NiceAddress result;
  nice_address_init(&result);
  nice_address_set_from_sockaddr(&result, address.get());
  return result;
}

/// Without port.
std::string host_of(const SocketAddress& address) {
  std::array<char, NICE_ADDRESS_STRING_LEN> host{};
  const NiceAddress nice = nice_address(address);
  nice_address_to_string(&nice, host.data());
  return host.data();
}

SocketAddress socket_address(const NiceAddress& address) {
  SocketAddress result;
  nice_address_copy_to_sockaddr(&address, result.get());
  result.size = address.s.addr.sa_family == AF_INET6 ? sizeof(sockaddr_in6) : sizeof(sockaddr_in);
  return result;
}

Candidate::Kind kind_of(NiceCandidateType type) {
  switch (type) {
    case NICE_CANDIDATE_TYPE_HOST:
      return Candidate::Kind::kHost;
    case NICE_CANDIDATE_TYPE_SERVER_REFLEXIVE:
      return Candidate::Kind::kServerReflexive;
    case NICE_CANDIDATE_TYPE_RELAYED:
      return Candidate::Kind::kRelayed;
    default:
      return Candidate::Kind::kPeerReflexive;
  }
}

NiceCandidateType nice_type(Candidate::Kind kind) {
  switch (kind) {
    case Candidate::Kind::kHost:
      return NICE_CANDIDATE_TYPE_HOST;
    case Candidate::Kind::kServerReflexive:
      return NICE_CANDIDATE_TYPE_SERVER_REFLEXIVE;
    case Candidate::Kind::kRelayed:
      return NICE_CANDIDATE_TYPE_RELAYED;
    default:
      return NICE_CANDIDATE_TYPE_PEER_REFLEXIVE;
  }
}

void set_up_loopback(NiceAgent* agent) {
  for (const char* host : {"127.0.0.1", "::1"}) {
    NiceAddress address;
    nice_address_init(&address);
    if (nice_address_set_from_string(&address, host)) nice_agent_add_local_address(agent, &address);
  }
}

}  // namespace

const char* name(PathKind kind) noexcept {
  switch (kind) {
    case PathKind::kHost:
      return "host";
    case PathKind::kReflexive:
      return "srflx";
    case PathKind::kRelayed:
      return "relay";
  }
  return "unknown";
}

int closing_agents() noexcept {
  return closing;
}

struct Agent::Signals {
  static void gathered(NiceAgent*, guint, gpointer self) {
    static_cast<Agent*>(self)->gathered_ = true;
    static_cast<Agent*>(self)->changed_();
  }
  static void candidate(NiceAgent*, NiceCandidate*, gpointer self) { static_cast<Agent*>(self)->changed_(); }
  static void pair(NiceAgent*, guint, guint, NiceCandidate*, NiceCandidate*, gpointer self) {
    static_cast<Agent*>(self)->changed_();
  }
  static void state(NiceAgent*, guint, guint, guint state, gpointer self) {
    static_cast<Agent*>(self)->failed_ = state == NICE_COMPONENT_STATE_FAILED;
    static_cast<Agent*>(self)->changed_();
  }
  static void received(NiceAgent*, guint, guint, guint size, gchar* bytes, gpointer self) {
    static_cast<Agent*>(self)->received_({reinterpret_cast<const std::uint8_t*>(bytes), size});
  }
  static void closed(GObject* agent, GAsyncResult*, gpointer) {
    --closing;
    g_object_unref(agent);
  }
};

/// What libnice has to say goes to standard error past everything that bounds and words it; what matters of it, this
/// program finds out by itself. Its own mistakes (critical) are still shown.
void silence_libnice() {
  constexpr auto kLevels =
      static_cast<GLogLevelFlags>(G_LOG_LEVEL_WARNING | G_LOG_LEVEL_MESSAGE | G_LOG_LEVEL_INFO | G_LOG_LEVEL_DEBUG);
  for (const char* part : {"libnice", "libnice-socket"})
    g_log_set_handler(
        part, kLevels, [](const gchar*, GLogLevelFlags, const gchar*, gpointer) {}, nullptr);
}

Agent::Agent(GMainContext* context, const AgentSetup& setup, std::function<void()> changed,
             std::function<void(std::span<const std::uint8_t>)> received)
    : agent_(nice_agent_new_full(
          context, NICE_COMPATIBILITY_RFC5245,
          static_cast<NiceAgentOption>(NICE_AGENT_OPTION_ICE_TRICKLE | NICE_AGENT_OPTION_CONSENT_FRESHNESS))),
      context_(context),
      changed_(std::move(changed)),
      received_(std::move(received)) {
  static std::once_flag silenced;
  std::call_once(silenced, silence_libnice);
  g_object_set(agent_, "controlling-mode", setup.controlling ? TRUE : FALSE, "upnp", FALSE, "ice-tcp", FALSE,
               "stun-initial-timeout", kFirstTimeout_ms, "stun-pacing-timer", kPacing_ms, nullptr);
  // A TURN server tells the address as well; libnice takes all that comes from it for TURN and waits in vain for the
  // answer to a plain STUN question.
  if (setup.stun && std::find(setup.turn.begin(), setup.turn.end(), *setup.stun) == setup.turn.end()) {
    g_object_set(agent_, "stun-server", host_of(*setup.stun).c_str(), "stun-server-port",
                 static_cast<guint>(setup.stun->port()), nullptr);
  }
  if (setup.loopback) set_up_loopback(agent_);
  g_signal_connect(agent_, "candidate-gathering-done", G_CALLBACK(Signals::gathered), this);
  g_signal_connect(agent_, "new-candidate-full", G_CALLBACK(Signals::candidate), this);
  g_signal_connect(agent_, "new-selected-pair-full", G_CALLBACK(Signals::pair), this);
  g_signal_connect(agent_, "component-state-changed", G_CALLBACK(Signals::state), this);
  stream_ = nice_agent_add_stream(agent_, 1);
  nice_agent_set_stream_tos(agent_, stream_, kExpedited);
  for (const SocketAddress& turn : setup.turn) {
    nice_agent_set_relay_info(agent_, stream_, kComponent, host_of(turn).c_str(), turn.port(), setup.turn_user.c_str(),
                              setup.turn_password.c_str(), NICE_RELAY_TYPE_TURN_UDP);
  }
  gchar *user = nullptr, *password = nullptr;
  if (nice_agent_get_local_credentials(agent_, stream_, &user, &password)) {
    user_ = user;
    password_ = password;
  }
  g_free(user);
  g_free(password);
  nice_agent_attach_recv(agent_, stream_, kComponent, context_, Signals::received, this);
  if (!nice_agent_gather_candidates(agent_, stream_)) failed_ = true;  // no address at all
}

Agent::~Agent() {
  g_signal_handlers_disconnect_by_data(agent_, this);
  nice_agent_attach_recv(agent_, stream_, kComponent, context_, nullptr, nullptr);
  ++closing;
  nice_agent_close_async(agent_, Signals::closed, nullptr);
}

std::vector<Candidate> Agent::candidates() const {
  std::vector<Candidate> result;
  GSList* list = nice_agent_get_local_candidates(agent_, stream_, kComponent);
  for (const GSList* at = list; at != nullptr; at = at->next) {
    const auto* one = static_cast<const NiceCandidate*>(at->data);
    if (one->transport != NICE_CANDIDATE_TRANSPORT_UDP) continue;
    result.push_back({kind_of(one->type), one->foundation, one->priority, socket_address(one->addr)});
  }
  g_slist_free_full(list, [](gpointer one) { nice_candidate_free(static_cast<NiceCandidate*>(one)); });
  return result;
}

void Agent::set_far_end(const Signal& signal) {
  if (far_.empty()) nice_agent_set_remote_credentials(agent_, stream_, signal.user.c_str(), signal.password.c_str());
  far_ = signal.candidates;
  GSList* list = nullptr;
  for (const Candidate& one : far_) {
    NiceCandidate* made = nice_candidate_new(nice_type(one.kind));
    made->transport = NICE_CANDIDATE_TRANSPORT_UDP;
    made->stream_id = stream_;
    made->component_id = kComponent;
    made->priority = one.priority;
    made->addr = nice_address(one.address);
    g_strlcpy(made->foundation, one.foundation.c_str(), sizeof made->foundation);
    list = g_slist_prepend(list, made);
  }
  if (list != nullptr) nice_agent_set_remote_candidates(agent_, stream_, kComponent, list);
  g_slist_free_full(list, [](gpointer one) { nice_candidate_free(static_cast<NiceCandidate*>(one)); });
  if (signal.complete) nice_agent_peer_candidate_gathering_done(agent_, stream_);
}

std::optional<PathPair> Agent::pair() const {
  NiceCandidate *local = nullptr, *remote = nullptr;
  if (!nice_agent_get_selected_pair(agent_, stream_, kComponent, &local, &remote)) return std::nullopt;
  PathPair pair{PathKind::kHost, socket_address(local->addr), socket_address(remote->addr)};
  // What a check has taught (peer-reflexive) may be an address that the far end has told meanwhile.
  const auto told =
      std::find_if(far_.begin(), far_.end(), [&](const Candidate& one) { return one.address == pair.remote; });
  const Candidate::Kind here = kind_of(local->type);
  const Candidate::Kind there = told != far_.end() ? told->kind : kind_of(remote->type);
  if (here == Candidate::Kind::kRelayed || there == Candidate::Kind::kRelayed)
    pair.kind = PathKind::kRelayed;
  else if (here != Candidate::Kind::kHost || there != Candidate::Kind::kHost)
    pair.kind = PathKind::kReflexive;
  return pair;
}

bool Agent::send(std::span<const std::uint8_t> datagram) {
  return nice_agent_send(agent_, stream_, kComponent, static_cast<guint>(datagram.size()),
                         reinterpret_cast<const gchar*>(datagram.data())) == static_cast<gint>(datagram.size());
}

}  // namespace knuckle::ice
