// A relay of datagrams between operators and one machine's side, through an impaired path each way. One thread, bounded
// memory; what the datagrams contain does not matter.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/relay/relay_flow.h"
#include "core/realtime_thread.h"
#include "transport/link_impairment.h"
#include "transport/socket_address.h"
#include "transport/udp_socket.h"

namespace knuckle::relay {

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
