// A relay of datagrams between operators and one machine's side, through an impaired path each way. One thread, bounded
// memory; what the datagrams contain does not matter.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "core/histogram.h"
#include "core/realtime_thread.h"
#include "core/time.h"
#include "transport/impaired_link.h"
#include "transport/link_impairment.h"
#include "transport/socket_address.h"
#include "transport/udp_socket.h"

namespace knuckle::relay {

// One operator's datagrams through the relay: a socket of its own towards the machine's side, an impaired path each
// way, and what came of them.
inline constexpr int kAtOnce = 64;  ///< Datagrams from one socket, before others have their turn.

struct DirectionReport {
  ImpairmentCounts counts;
  std::uint64_t forwarded = 0, forwarded_bytes = 0;
  std::uint64_t too_long = 0;     ///< More than Flow::kMostBytes: dropped.
  std::uint64_t not_sent = 0;     ///< The kernel took them not: nobody listens there, no route, a full buffer.
  std::uint64_t old_address = 0;  ///< Sent to an address that has changed since: dropped.
  std::uint64_t address_changes = 0;
  Histogram delay;     ///< From its arrival at this computer to its being sent on.
  Histogram lateness;  ///< Of that, what the model did not ask for.
};

struct FlowReport {
  std::uint64_t number = 0;  ///< 1 for the first.
  SocketAddress operators;
  Time began_at{}, heard_at{};  ///< First and last datagram of the operator, in the relay's time.
  DirectionReport to_machine, to_operator;
};

/// What all flows share.
struct RelayPlan {
  SocketAddress listen, connect;
  LinkImpairment to_machine, to_operator;
  std::uint64_t seed = 1;
  Time began_at{};  ///< In the relay's time: 0 of the link file's.
};

class Flow {
 public:
  static constexpr std::size_t kMostBytes = 1472;  ///< As a path for packets of 1500 bytes has room for.

  /// @param plan, @param listening what the operator has sent to: outlive this.
  /// @throws InputError where this computer cannot send to the machine's side.
  Flow(std::uint64_t number, const SocketAddress& operators, const RelayPlan& plan, const UdpSocket& listening,
       Time now);

  // Times are the relay's.
  /// @param through_listening false: it came to an address of this flow's own.
  void from_operator(std::span<const std::uint8_t> bytes, Time arrived_at, bool through_listening) noexcept;
  void too_long_from_operator() noexcept { ++report_.to_machine.too_long; }
  /// Takes what waits in this flow's own sockets. @param buffer has room for kMostBytes + 1.
  void receive(const RealtimeClock& clock, std::span<std::uint8_t> buffer) noexcept;
  /// Sends what is due, both ways.
  void send_due(const RealtimeClock& clock) noexcept;
  /// Each returns the new address. @throws InputError where there is no port left.
  SocketAddress change_address_to_machine();
  SocketAddress change_address_to_operator();

  [[nodiscard]] Time next_due() const noexcept;
  /// -1 where there is none.
  [[nodiscard]] std::array<int, 2> descriptors() const noexcept;
  [[nodiscard]] FlowReport report() const;
  [[nodiscard]] const FlowReport& so_far() const noexcept { return report_; }  ///< Without the models' counts.
  /// Whether nobody listens at the machine's side, as the kernel says; once, until something comes from there.
  [[nodiscard]] bool take_refusal() noexcept;

 private:
  /// One direction: arrivals never go back in time, whatever the computer's clock does.
  struct Path {
    Path(const LinkImpairment& impairment, std::uint64_t seed) : path(impairment, seed, kMostBytes) {}
    ImpairedPath path;
    Time newest{};
  };
  [[nodiscard]] Time in_plan(Time at) const noexcept { return Time(at - plan_.began_at); }
  void add(Path& path, std::span<const std::uint8_t> bytes, Time arrived_at) noexcept;
  void forward(Path& path, DirectionReport& report, const UdpSocket& socket, const SocketAddress& to,
               const RealtimeClock& clock) noexcept;
  void note_error(int error) noexcept;

  const RelayPlan& plan_;
  const UdpSocket& listening_;
  FlowReport report_;
  UdpSocket upstream_;                ///< Connected to the machine's side.
  std::optional<UdpSocket> answers_;  ///< Instead of the listening one, after an address change.
  Path to_machine_, to_operator_;
  bool refused_ = false, refusal_taken_ = false;
};

struct RelaySetup {
  std::string listen;   ///< ADDR:PORT in numbers.
  std::string connect;  ///< HOST:PORT, looked up once.
  LinkImpairment to_machine{}, to_operator{};
  std::uint64_t seed = 1;
};

/// Something worth a line.
struct RelayEvent {
  Time at{};
  std::string what, kind;  ///< As ProgramConsole::event takes them.
};

class Relay {
 public:
  static constexpr std::size_t kMostFlows = 8;    ///< Operators at once; datagrams of others are dropped.
  static constexpr Duration kForgetAfter = 30s;   ///< An operator that is silent for so long makes room.
  static constexpr std::size_t kMostEnded = 256;  ///< Reports of flows that have ended.

  /// @throws InputError where an address is wrong or cannot be used, or a setting is impossible.
  explicit Relay(const RelaySetup& setup);

  /// Forwards what comes and what is due until then; sleeps where there is nothing to do.
  void run_until(const RealtimeClock& clock, Time until);

  /// What has happened since the last call.
  [[nodiscard]] std::vector<RelayEvent> take_events();
  /// Where operators send to.
  [[nodiscard]] SocketAddress address() const noexcept { return plan_.listen; }
  [[nodiscard]] std::size_t active_flows() const noexcept;
  /// All there were; those that are still active last.
  [[nodiscard]] std::vector<FlowReport> reports() const;
  [[nodiscard]] std::uint64_t reports_left_out() const noexcept { return left_out_; }
  /// Datagrams of operators for whom there was no room, or no way to the machine's side.
  [[nodiscard]] std::uint64_t refused_datagrams() const noexcept { return refused_; }
  /// When the first datagram came: 0 of the link file's times. kNever: none has come.
  [[nodiscard]] Time began_at() const noexcept { return plan_.began_at; }

 private:
  struct Standing {  ///< What is known to be in force, of one direction.
    const char* name;
    std::size_t changes = 0, address_changes = 0;
    bool out = false;
  };
  void receive_from_operators(const RealtimeClock& clock);
  /// nullptr: there is no room, or no way to the machine's side; that is told.
  Flow* flow_of(const SocketAddress& from, Time now);
  Flow* begin_flow(const SocketAddress& from, Time now);
  void follow_plan(Time now);
  void follow(Time now, const LinkImpairment& plan, Standing& standing, SocketAddress (Flow::*change_address)());
  void look_after_flows(Time now);
  void wait(const RealtimeClock& clock, Time until) const;
  void tell(Time at, std::string what, std::string kind = "") {
    events_.push_back({at, std::move(what), std::move(kind)});
  }

  RelayPlan plan_;
  UdpSocket listening_;
  std::array<std::unique_ptr<Flow>, kMostFlows> flows_;
  std::uint64_t flows_begun_ = 0, refused_ = 0, left_out_ = 0;
  bool full_told_ = false;
  std::vector<FlowReport> ended_;
  std::vector<RelayEvent> events_;
  Standing to_machine_{"to the machine"}, to_operator_{"to the operator"};
  std::array<std::uint8_t, Flow::kMostBytes + 1> buffer_{};
};

[[nodiscard]] cli::Command relay_entry();

}  // namespace knuckle::relay
