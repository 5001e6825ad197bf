// The link between paired ends, authenticated and encrypted: DTLS over UDP. One end listens (the machine's), the other
// connects. The loops seal and open their own datagrams, without another thread in between; handshakes are made by a
// thread of this object and arrive on a socket of their own, so that a flood of them costs the loops nothing.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/ring.h"
#include "transport/link.h"
#include "transport/secure/dtls_session.h"
#include "transport/udp_socket.h"

namespace knuckle::secure {

/// What happened to the link, for people and for the audit trail.
struct LinkEvent {
  enum class Kind : std::uint8_t {
    kConnected,  ///< A paired far end; it has control now.
    kRenewed,    ///< The same one, with new keys.
    kRefused,    ///< `refusal` says why.
    kMoved,      ///< Its address has changed.
    kClosed,     ///< It has said farewell.
  } kind = Kind::kRefused;
  SocketAddress address;
  Fingerprint peer;                              ///< All zero where it showed no certificate.
  std::array<char, kMostNameLength + 1> name{};  ///< As it is called here; of kBusy: who has control.
  Refusal refusal = Refusal::kNone;
};
/// "connected: desk 1 (QF3K-...) at 192.0.2.7:40123"
[[nodiscard]] std::string text(const LinkEvent& event);

struct SecureLinkTiming {
  std::chrono::milliseconds renew_keys{std::chrono::hours(1)};  ///< Operator's side: new handshake after so long.
  std::chrono::milliseconds silence{1000};  ///< Then the far end is gone: anybody paired may have control, ...
  std::chrono::milliseconds answer{4000};   ///< ... and the operator's side tries anew. A handshake takes at most this.
};

class SecureLink final : public Link {
 public:
  /// @param address "ADDR:PORT" in numbers. @throws InputError where it is malformed or cannot be bound.
  [[nodiscard]] static std::unique_ptr<SecureLink> listen(const std::string& address, const Identity& identity,
                                                          Peers peers, const SecureLinkTiming& timing = {});
  /// @param address "ADDR:PORT" or "NAME:PORT"; of a name's addresses, of both families, whichever answers first.
  /// @throws InputError where it is malformed, or the name has no address.
  [[nodiscard]] static std::unique_ptr<SecureLink> connect(const std::string& address, const Identity& identity,
                                                           Peers peers, const SecureLinkTiming& timing = {});
  ~SecureLink() override;

  // The loop's thread.
  /// False where there is no session, or the far end of a listening one has been silent.
  bool send(std::span<const std::uint8_t> bytes) noexcept override;
  bool receive(Datagram& datagram) noexcept override;
  /// Says farewell: the far end knows at once that nobody is here.
  void close() noexcept;

  // Any one other thread.
  bool next(LinkEvent& event) noexcept { return handshake_events_.pop(event) || loop_events_.pop(event); }
  /// What keeps the link from being there, in one line; empty where it is, or nothing is known yet.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] std::uint16_t port() const noexcept;

 private:
  using Clock = std::chrono::steady_clock;

  /// A session whose handshake is done, on its way from the handshake's thread to the loop's.
  struct Offer {
    std::unique_ptr<DtlsSession> session;
    SocketAddress address;
    Fingerprint peer;
  };
  struct Handshake {
    std::unique_ptr<DtlsSession> session;
    SocketAddress address;
    Clock::time_point since;
    int busy_told = 0;  ///< How often it was told that another has control.
    bool done = false;
  };

  SecureLink(SocketPair sockets, const Identity& identity, Peers peers, Role role, std::vector<SocketAddress> targets,
             const SecureLinkTiming& timing);

  // The loop's thread.
  void take_offer() noexcept;
  [[nodiscard]] bool open(std::span<const std::uint8_t> bytes, const SocketAddress& from, Datagram& datagram) noexcept;
  void follow(const SocketAddress& from) noexcept;
  void report(LinkEvent::Kind kind) noexcept;
  [[nodiscard]] bool silent() const noexcept;
  void send_inner(Inner kind, std::span<const std::uint8_t> bytes, const SocketAddress& to) noexcept;

  // The handshakes' thread.
  void run();
  void read_handshakes(Clock::time_point now);
  void hear(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now);
  void hear_stranger(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now);
  [[nodiscard]] bool hear_again(std::span<const std::uint8_t> bytes, const SocketAddress& from);
  void advance(Handshake& handshake, DtlsSession::Progress progress, Clock::time_point now);
  void offer(Handshake& handshake, Clock::time_point now);
  void tell_busy(Handshake& handshake);
  void tend(Clock::time_point now);
  void start_where_needed(Clock::time_point now);
  void fail(const Handshake& handshake, Refusal refusal);
  void put(const LinkEvent& event) noexcept { handshake_events_.push(event); }
  [[nodiscard]] LinkEvent event_of(LinkEvent::Kind kind, const SocketAddress& address, const Fingerprint& peer) const;

  const SocketPair sockets_;
  const DtlsContext context_;
  const Role role_;
  const std::vector<SocketAddress> targets_;
  const SecureLinkTiming timing_;

  // The loop's thread.
  std::unique_ptr<Offer> current_,
      previous_;        // the previous one still opens what was sealed before new keys were there
  bool talks_ = false;  // the current session has not been closed
  struct Move {
    SocketAddress to;
    std::uint64_t nonce = 0;
    Clock::time_point asked_at{};
  } move_;

  // Between the threads.
  std::atomic<Offer*> offered_{nullptr};
  std::atomic<std::uint64_t> offered_tag_{0};
  Ring<Offer*, 16> retired_;
  std::atomic<Clock::rep> heard_at_{0};  // since the clock's epoch; 0: never, or gone
  std::atomic<bool> busy_there_{false};
  Ring<LinkEvent, 64> handshake_events_, loop_events_;
  std::atomic<bool> ending_{false};
  mutable std::mutex problem_mutex_;  // of two threads that are not real-time
  std::string problem_;

  // The handshakes' thread.
  std::vector<Handshake> handshakes_;
  std::unique_ptr<DtlsSession> listening_;
  std::optional<Fingerprint> holder_;
  std::array<Tag, 2> tags_{};  // of the two newest sessions
  Clock::time_point made_at_{}, try_at_{};
  int hellos_left_ = 0;
  Clock::time_point hellos_at_{};
  std::thread thread_;
};

}  // namespace knuckle::secure
