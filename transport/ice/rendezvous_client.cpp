#include "transport/ice/rendezvous_client.h"

#include <fcntl.h>
#include <gio/gio.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace knuckle::ice {
namespace {

using namespace std::chrono_literals;

constexpr auto kFirstPause = 250ms, kLongestPause = 8000ms;
constexpr auto kPingEvery = 5000ms, kAnswerTime = 4000ms, kAnswerInDoubt = 1000ms;
constexpr guint kDialTimeout_s = 5;
constexpr std::size_t kMostUnsent = 1 << 16;
constexpr int kMostLinesPerSecond = 100;  // a rendezvous that sends more is left, and dialled again later

}  // namespace

/// What a dialling that is under way may still find when it ends: its client, or nothing.
struct RendezvousClient::Dialling {
  RendezvousClient* client;
  GCancellable* cancel = g_cancellable_new();
  explicit Dialling(RendezvousClient* whose) : client(whose) {}
  ~Dialling() { g_object_unref(cancel); }
  Dialling(const Dialling&) = delete;
  Dialling& operator=(const Dialling&) = delete;

  static void done(GObject* source, GAsyncResult* result, gpointer data) {
    const std::unique_ptr<std::shared_ptr<Dialling>> held(static_cast<std::shared_ptr<Dialling>*>(data));
    GError* error = nullptr;
    GSocketConnection* connection = g_socket_client_connect_to_host_finish(G_SOCKET_CLIENT(source), result, &error);
    const std::string why = error != nullptr ? error->message : "";
    if (error != nullptr) g_error_free(error);
    // A descriptor of our own: the connection closes its one.
    Descriptor socket;
    if (connection != nullptr) {
      const int theirs = g_socket_get_fd(g_socket_connection_get_socket(connection));
      socket = Descriptor(::fcntl(theirs, F_DUPFD_CLOEXEC, 0));
      g_object_unref(connection);
    }
    RendezvousClient* client = (*held)->client;
    if (client == nullptr) return;
    client->dialling_.reset();
    if (socket)
      client->connected(std::move(socket));
    else
      client->failed(why);
  }
};

RendezvousClient::RendezvousClient(GMainContext* context, std::string address, Listener& listener)
    : context_(context), address_(std::move(address)), listener_(listener), back_off_(kFirstPause) {}

RendezvousClient::~RendezvousClient() {
  if (dialling_) {
    dialling_->client = nullptr;
    g_cancellable_cancel(dialling_->cancel);
  }
}

void RendezvousClient::dial() {
  dialling_ = std::make_shared<Dialling>(this);
  GSocketClient* client = g_socket_client_new();
  g_socket_client_set_enable_proxy(client, FALSE);
  g_socket_client_set_timeout(client, kDialTimeout_s);
  g_socket_client_connect_to_host_async(client, address_.c_str(), 0, dialling_->cancel, Dialling::done,
                                        new std::shared_ptr<Dialling>(dialling_));
  g_object_unref(client);
}

void RendezvousClient::connected(Descriptor socket) {
  socket_ = std::move(socket);
  const int on = 1;
  (void)::setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  in_ = {};
  out_.clear();
  problem_.clear();
  window_at_ = pinged_at_ = Clock::now();
  answer_by_ = pinged_at_ + kAnswerTime;  // to the joining
  lines_ = 0;
  readable_ = GlibSource::readable(context_, socket_.get(), [this] { read(); });
  for (const std::string& room : rooms_) write("join " + room);
}

void RendezvousClient::hang_up() {
  readable_ = {};
  socket_.close();
  answer_by_.reset();
}

void RendezvousClient::set_rooms(std::vector<std::string> rooms) {
  rooms_ = std::move(rooms);
  hang_up();
  problem_.clear();
  dial_at_ = {};
}

void RendezvousClient::failed(const std::string& why) {
  hang_up();
  problem_ = "rendezvous " + address_ + ": " + why;
  dial_at_ = Clock::now() + back_off_;
  back_off_ = std::min(2 * back_off_, kLongestPause);
}

void RendezvousClient::tend(Clock::time_point now) {
  if (!socket_) {
    if (!dialling_ && !rooms_.empty() && now >= dial_at_) dial();
    return;
  }
  flush();
  if (!socket_) return;
  if (answer_by_ && now > *answer_by_) return failed("does not answer");
  if (now - pinged_at_ < kPingEvery) return;
  pinged_at_ = now;
  if (!answer_by_) answer_by_ = now + kAnswerTime;
  write("ping");
}

void RendezvousClient::doubt(Clock::time_point now) {
  back_off_ = kFirstPause;
  dial_at_ = std::min(dial_at_, now);
  if (!socket_ || (answer_by_ && *answer_by_ <= now + kAnswerInDoubt)) return;
  pinged_at_ = now;
  answer_by_ = now + kAnswerInDoubt;
  write("ping");
}

void RendezvousClient::read() {
  std::array<char, 8192> bytes;
  const ssize_t got = ::recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (got < 0) return failed(std::strerror(errno));
  if (got == 0) return failed("has closed the connection");
  const auto now = Clock::now();
  if (now - window_at_ >= 1s) {
    window_at_ = now;
    lines_ = 0;
  }
  const bool fits = in_.add({bytes.data(), static_cast<std::size_t>(got)});
  while (socket_) {
    const auto line = in_.next();
    if (!line) break;
    if (++lines_ > kMostLinesPerSecond) return failed("sends too much");
    obey(*line);
  }
  if (!fits && socket_) failed("is no rendezvous of Knuckle");
}

void RendezvousClient::obey(std::string_view line) {
  const auto notice = parse_notice(line);
  if (!notice) return failed("is no rendezvous of Knuckle");
  answer_by_.reset();
  if (notice->verb == "refused") return failed("has refused this computer: " + std::string(notice->rest));
  back_off_ = kFirstPause;
  const std::string room(notice->room);
  if (std::find(rooms_.begin(), rooms_.end(), room) == rooms_.end()) return;
  if (notice->verb == "message") {
    if (const auto bytes = bytes_of_base64(notice->rest)) listener_.message(room, *bytes);
  } else if (notice->rest != "0") {
    listener_.somebody_in(room);
  }
}

void RendezvousClient::send(const std::string& room, const Bytes& bytes) {
  if (socket_) write("send " + room + " " + base64(bytes));
}

void RendezvousClient::write(std::string_view line) {
  if (out_.size() + line.size() > kMostUnsent) return failed("takes nothing");
  out_.append(line).push_back('\n');
  flush();
}

void RendezvousClient::flush() {
  if (!socket_ || out_.empty()) return;
  const ssize_t sent = ::send(socket_.get(), out_.data(), out_.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent > 0) out_.erase(0, static_cast<std::size_t>(sent));
  if (sent < 0 && errno != EAGAIN && errno != EINTR) failed(std::strerror(errno));
}

}  // namespace knuckle::ice
