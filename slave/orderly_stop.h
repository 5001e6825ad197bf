// Takes a running machine out of service: spools to neutral and pilot pressure off, valves disabled, nodes out of their
// operational state and without a heartbeat to monitor, and only then no more frames. Nodes that have left their
// operational state by themselves are asked by SDO. Where a node does not confirm, all others stay operational with
// their watchdogs on, which then switch the outputs off. Of a machine that is told by command frames: neutral until its
// pilot pressures tell that every spool is shut, or for as long as one may take, then no more frames; its own
// controller has nothing more to do by then.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/joints.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "slave/command_frames.h"
#include "slave/valve_frame.h"
#include "transport/can_bus.h"
#include "transport/canopen.h"

namespace knuckle::slave {

class OrderlyStop {
 public:
  /// @param bus outlives this.
  OrderlyStop(const MachineDescription& machine, CanBus& bus);

  /// Before the first step: command frames go on where the loop's ended.
  void go_on_from(const CommandFrames& before) noexcept { commands_.go_on_from(before); }

  /// In place of the slave loop's step, every SYNC period, until done(). SYNC and heartbeat go on until then.
  /// @param has_address as of CommandFrames::step()
  void step(Time now, bool has_address = true) noexcept;
  [[nodiscard]] bool done() const noexcept { return phase_ == Phase::kDone; }
  /// Valves that did not confirm disabled, or whose pilot pressures did not tell that they are shut, and an enable
  /// node, or a machine that tells it, that did not confirm pilot pressure off.
  [[nodiscard]] PerJoint<bool> unconfirmed_valves() const noexcept;
  [[nodiscard]] bool unconfirmed_pilot() const noexcept { return !pilot_off_; }

 private:
  enum class Phase : std::uint8_t { kNeutral, kDisable, kRelease, kDone };
  struct Valve {
    bool heard = false;
    std::uint16_t status_word = 0;
    double spool = 0;
  };
  struct Pilot {
    std::optional<double> extend_Pa{}, retract_Pa{};
  };
  void hear() noexcept;
  void hear_pilots(const CanFrame& frame) noexcept;
  void hear_answer(std::uint8_t node, const canopen::SdoResponse& answer) noexcept;
  void ask_resting() noexcept;
  void send_commands(std::uint16_t ValveWords::*state, bool at_once, Time now) noexcept;
  void heartbeat(Time now) noexcept;
  void enter(Phase phase, Time now) noexcept;
  [[nodiscard]] bool tells_pilot() const noexcept;
  [[nodiscard]] bool at_rest() const noexcept;
  [[nodiscard]] bool is_shut(int joint) const noexcept;
  [[nodiscard]] bool confirmed() const noexcept;
  [[nodiscard]] bool disabled(const Valve& valve) const noexcept;

  const MachineDescription& machine_;
  CanBus& bus_;
  CommandFrames commands_;
  bool has_address_ = true;
  std::vector<std::uint8_t> held_;  // node ids still to be released
  Phase phase_ = Phase::kNeutral;
  Time phase_since_ = kNever, heartbeat_at_ = kNever;
  std::bitset<128> resting_;  // node ids whose heartbeat last said that they are not operational
  PerJoint<Valve> valves_{};
  PerJoint<Pilot> pilots_{};
  bool pilot_off_ = false;
  bool alone_ = true;  // no SYNC of somebody else
  int syncs_ = 0;
};

}  // namespace knuckle::slave
