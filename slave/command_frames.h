// The frames by which the machine's own controller is told what to do: each by its period, and at once where a joint is
// to stop. They take only what a gate has let pass, or neutral.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/joints.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "slave/safety_gate.h"
#include "transport/can_bus.h"

namespace knuckle::slave {

class CommandFrames {
 public:
  explicit CommandFrames(const BusDescription& bus);

  /// Sends what is due. What the bus does not take is due again in the next step.
  /// @param led an operator leads the machine: constants have their values for that.
  /// @param has_address frames from the J1939 address may go out
  /// @param withheld frames for the module of this id do not, or, where it is 0, for the machine's own controller
  void step(const PassedCommands& commands, bool led, CanBus& bus, Time now, bool has_address = true,
            std::optional<std::uint8_t> withheld = {}) noexcept;

  /// Of the same bus: what was sent last, and where the counters stand.
  void go_on_from(const CommandFrames& before) noexcept;

  /// As last sent, of the joints.
  [[nodiscard]] const JointVector& demand() const noexcept { return demand_; }
  /// When a frame for a joint was last sent; kNever before the first.
  [[nodiscard]] Time sent_at() const noexcept { return sent_at_; }

 private:
  struct Sent {
    CommandFrame frame;
    Duration period{};
    Time due = kNever;
    std::uint64_t count = 0;
    bool resting = false;  ///< Nobody leads, and that has been sent.
  };
  [[nodiscard]] static bool stops(const CommandFrame& frame, const PassedCommands& commands,
                                  const JointVector& demand) noexcept;
  [[nodiscard]] bool send(Sent& one, const PassedCommands& commands, bool led, CanBus& bus) noexcept;

  std::vector<Sent> frames_;  // sized once, at construction
  JointVector demand_ = JointVector::Zero();
  Time sent_at_ = kNever;
  bool led_ = false;
};

}  // namespace knuckle::slave
