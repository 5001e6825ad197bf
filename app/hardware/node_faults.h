// What simulated nodes can be made to do wrong on a real bus, at a time or at a signal: for trying out how the other
// side takes it.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "app/scenario.h"
#include "core/time.h"
#include "machine/description.h"
#include "sim/simulated_machine.h"
#include "transport/can_bus.h"

namespace knuckle::app {

/// Those that a scenario knows too, then those that only a bus of its own shows. By name in kNodeFaultNames.
enum class NodeFaultKind : std::uint8_t {
  kSilent,         ///< its cable is off
  kEmergency,      ///< one EMCY; its reset when mended
  kFrozen,         ///< goes on sending its last value
  kInvalid,        ///< sends the impossible value
  kEncoderBroken,  ///< wire snapped: the length runs to its end
  kValveStuck,     ///< the spool stays where it is
  kEStop,          ///< E-stop chain of the machine opens
  kReset,          ///< reboots by itself and has lost its configuration
  kWrongIdentity,  ///< answers with another product code
  kEmcyStorm,      ///< an EMCY every millisecond
  kSyncDropped,    ///< no node hears SYNC
  kBusCut,         ///< no node hears or is heard
  kBabble,         ///< somebody fills the bus to 95 % with frames of the highest priority
};
inline constexpr std::array<const char*, 13> kNodeFaultNames{
    "node_silent", "node_emergency", "sensor_frozen", "sensor_invalid", "encoder_broken", "valve_stuck", "e_stop",
    "node_reset",  "wrong_identity", "emcy_storm",    "sync_dropped",   "bus_cut",        "babble"};

struct PlannedFault {
  NodeFaultKind kind = NodeFaultKind::kSilent;
  std::uint8_t node = 0;       ///< 0 where the kind concerns none.
  std::optional<double> at_s;  ///< nullopt: at every SIGUSR1 that finds it mended.
  double duration_s = std::numeric_limits<double>::infinity();
  std::string text;  ///< As it was asked for.
};
/// "KIND[:NODE]@S[+D]", with usr1 for S at a signal; NODE by name or id.
/// @throws InputError naming --fault, its value and what is wrong with it.
[[nodiscard]] PlannedFault parse_fault(const std::string& text, const BusDescription& bus);

/// The nodes' port, with what can be done to it.
class FaultyPort final : public CanBus {
 public:
  explicit FaultyPort(CanBus& bus) noexcept : bus_(bus) {}
  bool send(const CanFrame& frame) noexcept override;
  bool receive(CanFrame& frame) noexcept override;
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }
  void acknowledge() noexcept override { bus_.acknowledge(); }

  void cut(bool on) noexcept { cut_ = on; }
  void drop_sync(bool on) noexcept { drop_sync_ = on; }
  /// Only the nodes on this port hear it, before anything else.
  void whisper(const CanFrame& frame) noexcept { whispered_ = frame; }
  /// Past everything else, onto the bus.
  bool shout(const CanFrame& frame) noexcept { return bus_.send(frame); }

 private:
  CanBus& bus_;
  bool cut_ = false, drop_sync_ = false;
  std::optional<CanFrame> whispered_;
};

/// A planned fault was broken or mended.
struct FaultEvent {
  std::size_t fault = 0;  ///< Its place in the plan.
  Time at{};
  bool broken = false;
};

class NodeFaults {
 public:
  /// @param bus as the machine file says; @param port outlives this.
  NodeFaults(std::vector<PlannedFault> plan, const BusDescription& bus, FaultyPort& port);

  /// Every millisecond, before the machine's step. @param signals SIGUSR1 so far.
  /// @param on_event called with each FaultEvent; must be fit for a step.
  template <typename OnEvent>
  void step(Time now, std::uint32_t signals, sim::SimulatedMachine& machine, const OnEvent& on_event) noexcept {
    const bool signalled = signals != signals_seen_;
    signals_seen_ = signals;
    for (std::size_t i = 0; i < plan_.size(); ++i) {
      if (toggle(i, now, signalled, machine)) on_event(FaultEvent{i, now, state_[i].broken});
      if (state_[i].broken) keep_up(plan_[i], machine);
    }
  }

 private:
  struct State {
    bool broken = false, done = false;
    Time at{};
  };
  [[nodiscard]] bool toggle(std::size_t index, Time now, bool signalled, sim::SimulatedMachine& machine) noexcept;
  void set(const PlannedFault& fault, bool broken, sim::SimulatedMachine& machine) noexcept;
  /// What has to be done again every millisecond.
  void keep_up(const PlannedFault& fault, sim::SimulatedMachine& machine) noexcept;

  std::vector<PlannedFault> plan_;
  std::vector<State> state_;
  BusDescription bus_;
  FaultyPort& port_;
  double babble_bits_per_ms_, babble_bits_ = 0;
  std::uint32_t signals_seen_ = 0;
};

}  // namespace knuckle::app
