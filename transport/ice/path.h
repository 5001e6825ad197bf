// The path to one far end: attempts of ICE one after another, the newest that works in use, and between it and this
// computer's end of the secure link a loopback socket. The link's sessions know nothing of it: to them the far end has
// one address, whatever way its datagrams take. A path that has failed is used until there is another.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/histogram.h"
#include "transport/ice/agent.h"
#include "transport/ice/signal.h"
#include "transport/secure/dtls_session.h"
#include "transport/udp_socket.h"

namespace knuckle::ice {

// Whether a path carries datagrams both ways, and how long they take: small questions that only the far end of the path
// can answer, ten a second, beside what the ends send each other. Not authenticated: whoever is on the path can answer
// them, and could drop everything as well.

/// First byte: neither STUN (0-3), DTLS (20-63), nor TURN channels (64-79). An observer's tag may begin with it, too
/// (0x80 to 0xBF): but what the secure link sends is longer than a beat.
inline constexpr std::uint8_t kBeatMark = 0xB0;
inline constexpr std::size_t kBeatSize = 10;
using Beat = std::array<std::uint8_t, kBeatSize>;

class Heartbeat {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kEvery{100};

  [[nodiscard]] static bool is_beat(std::span<const std::uint8_t> datagram) noexcept {
    return datagram.size() == kBeatSize && datagram[0] == kBeatMark;
  }

  /// The next question, where it is time for one. @param in_use this end sends over the path.
  [[nodiscard]] std::optional<Beat> question(Clock::time_point now, bool in_use);
  /// @return the answer, where it is a question.
  [[nodiscard]] std::optional<Beat> hear(std::span<const std::uint8_t> datagram, Clock::time_point now);
  /// Asks at once.
  void hurry() noexcept { asked_at_ = {}; }

  [[nodiscard]] std::optional<Clock::time_point> answered_at() const noexcept { return answered_at_; }
  /// A question came.
  [[nodiscard]] std::optional<Clock::time_point> heard_at() const noexcept { return heard_at_; }
  [[nodiscard]] bool far_end_uses() const noexcept { return far_end_uses_; }
  /// Of the newest answer; taken once.
  [[nodiscard]] std::optional<Clock::duration> take_round_trip() noexcept;

 private:
  using Number = std::array<std::uint8_t, 8>;
  struct Asked {
    Number number{};
    Clock::time_point at{};
    bool open = false;
  };
  std::array<Asked, 32> asked_{};
  std::size_t next_ = 0;
  Clock::time_point asked_at_{};
  std::optional<Clock::time_point> answered_at_, heard_at_;
  std::optional<Clock::duration> round_trip_;
  bool far_end_uses_ = false;
};

/// What happened to a path, for people.
struct PathEvent {
  enum class Kind : std::uint8_t {
    kSearching,  ///< The far end is there: candidates are being checked.
    kInUse,      ///< Another pair than before.
    kLost,       ///< Nothing comes through any more; another is being searched.
    kBack,       ///< It does again, before another was found.
    kFailed,     ///< An attempt has found none.
    kNoRelay,    ///< The TURN server gives no address. Told once, also where another path is found.
  } kind = Kind::kSearching;
  std::chrono::steady_clock::time_point at;
  std::string far_end;  ///< Its name.
  PathPair pair;        ///< Of kInUse.
  std::chrono::nanoseconds round_trip{};
  std::string relay;  ///< Of kNoRelay: host of the TURN server.
};
/// "path to desk 1: in use: host, 192.0.2.7:40001 to 192.0.2.9:40100, round trip 0.4 ms"
[[nodiscard]] std::string text(const PathEvent& event);

class Path {
 public:
  using Clock = std::chrono::steady_clock;

  struct Setup {
    GMainContext* context = nullptr;
    secure::Role role = secure::Role::kOperator;        ///< The operator's side makes the offers.
    std::function<AgentSetup(bool direct_only)> agent;  ///< Of an attempt that begins now.
    std::string relay;                                  ///< Host of the TURN server; empty: none.
    secure::Peer far_end;
    std::function<void(const Bytes&)> signal;  ///< To the far end, over the rendezvous.
    std::function<void(const PathEvent&)> report;
    std::function<void()> wake;  ///< tend() has something to do.
  };

  /// @param to_link connected to this computer's end of the secure link. @param signer outlives it.
  Path(Setup setup, const Signer& signer, UdpSocket to_link);

  /// A signal has come.
  void hear(std::span<const std::uint8_t> bytes, Clock::time_point now);
  /// Somebody is at the rendezvous, perhaps the far end.
  void somebody_there(Clock::time_point now);
  /// This computer has other addresses, or the far end has.
  void network_changed(Clock::time_point now);
  void tend(Clock::time_point now);

  [[nodiscard]] const std::string& far_end() const noexcept { return setup_.far_end.name; }
  [[nodiscard]] bool carries() const noexcept { return current_ != nullptr && !lost_; }
  [[nodiscard]] bool knows_far_end() const noexcept { return conversation_.knows_far_end(); }
  /// Of the pairs in use, over the whole run.
  [[nodiscard]] const Histogram& round_trips() const noexcept { return round_trips_; }

 private:
  struct Attempt {
    std::uint32_t number = 0;
    std::uint32_t session = 0;  // of the far end, counted
    bool direct_only = false;
    std::unique_ptr<Agent> agent;
    Heartbeat beat;
    Clock::time_point begun, told_at{};
    std::size_t told = 0;  // candidates
    bool told_complete = false, answered = false, spoke = false;
  };
  [[nodiscard]] bool operates() const noexcept { return setup_.role == secure::Role::kOperator; }
  void say(Signal signal) { setup_.signal(conversation_.say(std::move(signal))); }
  void report(PathEvent::Kind kind, Clock::time_point now);
  void begin(std::uint32_t number, bool direct_only, Clock::time_point now);
  void take_offer(const Signal& offer, Clock::time_point now);
  void tell_candidates(Attempt& attempt, Clock::time_point now);
  void look_for_relay(const std::vector<Candidate>& candidates, bool over, Clock::time_point now);
  void received(Attempt& attempt, std::span<const std::uint8_t> datagram);
  void send_beats(Attempt& attempt, Clock::time_point now);
  void use_attempt(Clock::time_point now);
  [[nodiscard]] bool attempt_works() const;
  void judge_current(Clock::time_point now);
  void judge_attempt(Clock::time_point now);
  void begin_where_needed(Clock::time_point now);
  void ask_for_attempt(Clock::time_point now);
  void report_pair(Clock::time_point now);
  void read_link();

  Setup setup_;
  Conversation conversation_;
  UdpSocket to_link_;
  std::unique_ptr<Attempt> current_, attempt_, previous_;  // previous_: what is still under way there comes through
  Clock::time_point switched_at_{};
  std::uint32_t attempts_ = 0, sessions_ = 0;
  bool lost_ = false, wanted_ = false, relay_missed_ = false;
  Clock::time_point begin_at_{}, improve_at_{}, changed_at_{}, said_again_at_{};
  Clock::time_point answered_at_{}, session_at_{}, hello_at_{}, greeted_at_{};
  std::chrono::milliseconds back_off_, improve_after_;
  std::optional<PathPair> reported_, seen_;
  Clock::time_point seen_at_{};
  std::chrono::nanoseconds round_trip_{};
  Histogram round_trips_;
  std::vector<Bytes> held_;  // of the link's handshake, until there is a path
  GlibSource link_readable_;
};

}  // namespace knuckle::ice
