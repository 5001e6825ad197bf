// The link between paired ends, authenticated and encrypted: DTLS over UDP. One end listens (the machine's), the other
// connects. The loops seal and open their own datagrams, without another thread in between; handshakes are made by a
// thread of this object and arrive on a socket of their own, so that a flood of them costs the loops nothing. The same
// thread seals the machine's messages for observers.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "core/mailbox.h"
#include "core/ring.h"
#include "transport/link.h"
#include "transport/other_version.h"
#include "transport/secure/dtls_session.h"
#include "transport/udp_socket.h"

namespace knuckle::secure {

/// A far end as it is called here, or as it calls itself; empty: unknown.
struct PeerName {
  std::array<char, kMostNameLength + 1> text{};

  PeerName() = default;
  /// Empty where it is no name.
  explicit PeerName(std::string_view name) noexcept;
  [[nodiscard]] std::string_view view() const noexcept { return text.data(); }
};

/// What happened to the link, for people and for the audit trail.
struct LinkEvent {
  enum class Kind : std::uint8_t {
    kConnected,  ///< A paired far end; it has control now (operator's side: this end has).
    kRenewed,    ///< The same one, with new keys.
    kRefused,    ///< `refusal` says why.
    kMoved,      ///< Its address has changed.
    kClosed,     ///< Machine's side: it has said farewell: control is released.
    kEnded,      ///< Operator's side: it has said farewell.
    kCutOff,     ///< It was connected, and is no longer admitted here: `refusal` says why.
    kAsked,      ///< Operator's side: `peer` asks for the control that this end has.
    kGranted,    ///< Machine's side: `peer` has let `other` have control.
    kObserves,   ///< Machine's side: an observer has come, ...
    kObserved,   ///< ... or gone.
    kTried,      ///< Machine's side: a paired end has tried the handshake (doctor).
  } kind = Kind::kRefused;
  SocketAddress address;  ///< None: not shown.
  Fingerprint peer;       ///< All zero where it showed no certificate. Of kRefused: shown, its key not always proven.
  PeerName name;          ///< As it is called here; of a refusal by the far end: who has control there.
  Refusal refusal = Refusal::kNone;
  Fingerprint other{};
  PeerName other_name{};
};
/// "connected: desk 1 (QF3K-...) at 192.0.2.7:40123"
[[nodiscard]] std::string text(const LinkEvent& event);

/// After control has changed hands, no message reaches the machine's loop for so long: longer than its loss policy
/// waits before it latches a lost link, so that the machine is neutral and has to be aligned anew.
inline constexpr std::chrono::milliseconds kHandOverGap{300};

struct SecureLinkTiming {
  std::chrono::milliseconds renew_keys{std::chrono::hours(1)};  ///< Operator's side: new handshake after so long.
  std::chrono::milliseconds silence{1000};  ///< Then the far end is gone: anybody paired may have control, ...
  std::chrono::milliseconds answer{4000};   ///< ... and the operator's side tries anew. A handshake takes at most this.
  std::chrono::milliseconds grant{10'000};  ///< How long whom control was granted to may take to come for it.
  std::chrono::milliseconds ask_again{30'000};  ///< Who has control is told of the same asker at most so often.
};

/// Whom an end admits and what it connects for, besides its peers.
struct SecureLinkAccess {
  Purpose purpose = Purpose::kControl;  ///< Operator's side: kControl or kObserve.
  std::size_t most_observers = 4;       ///< Machine's side.
  /// Asked once a second, by the handshakes' thread: the peers where they have changed. May be empty itself.
  std::function<std::optional<Peers>()> newer_peers{};
};

class SecureLink final : public Link {
 public:
  /// @param address "ADDR:PORT" in numbers. @throws InputError where it is malformed or cannot be bound.
  [[nodiscard]] static std::unique_ptr<SecureLink> listen(const std::string& address, const Identity& identity,
                                                          Peers peers, const SecureLinkTiming& timing = {},
                                                          SecureLinkAccess access = {});
  /// @param address "ADDR:PORT" or "NAME:PORT"; of a name's addresses, of both families, whichever answers first.
  /// @throws InputError where it is malformed, or the name has no address.
  [[nodiscard]] static std::unique_ptr<SecureLink> connect(const std::string& address, const Identity& identity,
                                                           Peers peers, const SecureLinkTiming& timing = {},
                                                           SecureLinkAccess access = {});
  ~SecureLink() override;

  // The loop's thread.
  /// False where there is no session, the far end of a listening one has been silent, or this end only observes.
  bool send(std::span<const std::uint8_t> bytes) noexcept override;
  bool receive(Datagram& datagram) noexcept override;
  [[nodiscard]] bool emptied() const noexcept override { return emptied_; }
  /// Says farewell: the far end knows at once that nobody is here. This end does not connect again.
  void close() noexcept;

  // Any one other thread.
  bool next(LinkEvent& event) noexcept { return handshake_events_.pop(event) || loop_events_.pop(event); }
  /// Those that came faster than they were taken.
  [[nodiscard]] std::uint64_t events_lost() const noexcept {
    return handshake_events_.dropped() + loop_events_.dropped();
  }
  /// Of the session that there is now, for pictures beside it; nullopt once it has ended. False where it is the same as
  /// before.
  bool take(std::optional<VideoSecret>& secret) noexcept { return video_secrets_.take(secret); }
  /// What keeps the link from being there, in one line; empty where it is, or nothing is known yet.
  [[nodiscard]] std::string problem() const;
  /// Of the far end's messages, where it is not this program's; 0: there were none of late.
  [[nodiscard]] std::uint8_t other_version() const noexcept { return other_version_.heard(); }
  [[nodiscard]] std::uint16_t port() const noexcept;
  /// Operator's side: this end has control, as far as is known.
  [[nodiscard]] bool has_control() const noexcept {
    return access_.purpose == Purpose::kControl && !released_.load(std::memory_order_relaxed) && !silent();
  }
  // Operator's side: what the loop's thread does at its next send().
  /// Gives control up, and does not ask for it again before take_control().
  void release() noexcept;
  /// The same, and only `to` may have it for a while.
  void grant(const Fingerprint& to) noexcept;
  void take_control() noexcept { released_.store(false, std::memory_order_relaxed); }

 private:
  using Clock = std::chrono::steady_clock;

  /// A session whose handshake is done, on its way from the handshake's thread to the loop's.
  struct Offer {
    std::unique_ptr<DtlsSession> session;
    SocketAddress address;
    Fingerprint peer;
    PeerName name;
    bool renews = false;  ///< New keys of the program that had control already.
  };
  struct Handshake {
    std::unique_ptr<DtlsSession> session;
    SocketAddress address;
    Clock::time_point since;
    bool done = false;
    int answers = 0;  ///< How often `answer` was sent, which nobody confirms.
    Refusal answer = Refusal::kNone;
    Clock::time_point answered_at{};
    Refusal if_silent = Refusal::kSilence;  ///< What is known of why nobody answers; anybody may have said it.
  };
  struct Holder {
    Fingerprint peer;
    Certificate certificate;
    SocketAddress address;
  };
  struct Observer {
    std::unique_ptr<DtlsSession> session;
    SocketAddress address;
    Fingerprint peer;
    Certificate certificate;
    Clock::time_point heard_at;
  };
  struct Asker {
    Fingerprint peer;
    PeerName name;
  };
  struct Release {
    bool grants = false;
    Fingerprint to;
  };

  SecureLink(SocketPair sockets, const Identity& identity, Peers peers, Role role, std::vector<SocketAddress> targets,
             const SecureLinkTiming& timing, SecureLinkAccess access);

  // The loop's thread (secure_link.cpp).
  void take_offer() noexcept;
  void tell_of_session() noexcept;
  void retire(std::unique_ptr<Offer>& offer) noexcept;
  [[nodiscard]] bool open(std::span<const std::uint8_t> bytes, const SocketAddress& from, Datagram& datagram) noexcept;
  [[nodiscard]] bool obey(Inner kind, const SocketAddress& from, const Datagram& datagram) noexcept;
  void follow(const SocketAddress& from) noexcept;
  void moved(const SocketAddress& from, const Datagram& datagram) noexcept;
  void hear_answer(const Datagram& datagram) noexcept;
  void hear_asker(const Datagram& datagram) noexcept;
  void tell_of_asker() noexcept;
  void release_where_asked() noexcept;
  void cut_off_where_asked() noexcept;
  void say_farewell() noexcept;
  void stop_talking() noexcept;
  void report(LinkEvent::Kind kind) noexcept;
  [[nodiscard]] bool silent() const noexcept;
  void send_inner(Inner kind, std::span<const std::uint8_t> bytes, const SocketAddress& to) noexcept;

  // The handshakes' thread (secure_link_handshakes.cpp).
  void run();
  void take_notes(Clock::time_point now);
  void read_handshakes(Clock::time_point now);
  void hear(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now);
  void hear_stranger(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now);
  [[nodiscard]] bool hear_again(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now);
  void hear_plain(const SocketAddress& from, Clock::time_point now);
  void hear_refusals();
  void suspect(const SocketAddress& address, Refusal refusal);
  void tell_problem(const SocketAddress& address, Refusal refusal);
  void advance(Handshake& handshake, DtlsSession::Progress progress, Clock::time_point now);
  void decide_control(Handshake& handshake, Clock::time_point now);
  [[nodiscard]] const Fingerprint* held_against(const Handshake& handshake, Clock::time_point now) const;
  void ask_for(const Handshake& handshake, Clock::time_point now);
  void offer(Handshake& handshake, Clock::time_point now);
  void answer(Handshake& handshake, Refusal refusal);
  void tend(Clock::time_point now);
  void start_where_needed(Clock::time_point now);
  void fail(const Handshake& handshake, Refusal refusal);
  void check_admitted();
  void cut_off_holder(Refusal refusal);
  [[nodiscard]] std::optional<std::vector<Handshake>::iterator> who_yields(const SocketAddress& from,
                                                                           Clock::time_point now);
  void hear_refusals_of_attempts(bool on);
  void free_retired();
  void put(const LinkEvent& event) noexcept { handshake_events_.push(event); }
  [[nodiscard]] PeerName name_of(const Fingerprint& peer) const noexcept;
  [[nodiscard]] LinkEvent event_of(LinkEvent::Kind kind, const SocketAddress& address, const Fingerprint& peer) const;
  // Its observers (secure_link_observers.cpp).
  void admit_observer(Handshake& handshake, Clock::time_point now);
  [[nodiscard]] bool hear_observer(std::span<const std::uint8_t> bytes, const SocketAddress& from,
                                   Clock::time_point now);
  void serve_observers(Clock::time_point now);

  const SocketPair sockets_;
  DtlsContext context_;
  const Role role_;
  const std::vector<SocketAddress> targets_;
  const SecureLinkTiming timing_;
  const SecureLinkAccess access_;

  // The loop's thread.
  std::unique_ptr<Offer> current_,
      previous_;        // the same far end's, which still opens what was sealed before new keys were there
  bool talks_ = false;  // the current session has not been closed
  std::optional<LinkEvent::Kind> untold_;  // operator's side: a session whose first message has not come
  bool emptied_ = false;                   // by the last receive() that found nothing
  Clock::time_point quiet_until_{}, said_alive_at_{}, asked_at_{};
  Asker asker_;  // machine's side: whom the far end is told of; operator's: who asked last
  int asks_left_ = 0;
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
  std::atomic<bool> released_{false};
  OtherVersion other_version_;
  std::atomic<int> observer_count_{0};
  Mailbox<Release> releases_;
  Mailbox<Asker> askers_;  // to the loop's thread, ...
  Mailbox<Fingerprint> cut_offs_;
  Mailbox<Fingerprint> grants_;  // ... and from it
  Mailbox<std::optional<VideoSecret>> video_secrets_;
  Mailbox<SocketAddress> moves_;
  struct RefusedBy {
    Refusal refusal = Refusal::kNone;
    PeerName name;
  };
  Mailbox<RefusedBy> refused_by_;
  Ring<Datagram, 64> copies_;  // for observers
  Ring<LinkEvent, 64> handshake_events_, loop_events_;
  std::atomic<bool> ending_{false};
  mutable std::mutex problem_mutex_;  // of two threads that are not real-time
  std::string problem_;

  // The handshakes' thread.
  std::vector<Handshake> handshakes_;
  std::vector<Observer> observers_;
  std::unique_ptr<DtlsSession> listening_;
  std::optional<Holder> holder_;
  std::optional<Fingerprint> granted_to_;
  std::vector<std::pair<Fingerprint, Clock::time_point>> asked_;  // lately
  std::array<Tag, 2> tags_{};                                     // of the newest session and the loop's
  struct LastWords {                                              // machine's side: what ended its handshake
    SocketAddress to;
    std::vector<std::vector<std::uint8_t>> datagrams;
    Clock::time_point said_at;
  } last_words_;
  Clock::time_point made_at_{}, taken_at_{}, try_at_{}, granted_at_{}, peers_at_{};
  int hellos_left_ = 0;
  Clock::time_point hellos_at_{}, cookies_at_{}, plain_at_{};
  std::vector<SocketAddress> to_try_;  // operator's side: in this attempt, the next one last
  Clock::time_point begun_at_{};
  std::thread thread_;
};

}  // namespace knuckle::secure
