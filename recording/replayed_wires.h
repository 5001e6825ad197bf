// The three wires as a recording has them: a loop that steps on them reads what the recorded one read, and what it
// writes is held against what that one wrote.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "recording/wire_events.h"
#include "transport/can_bus.h"
#include "transport/hid_port.h"
#include "transport/link.h"

namespace knuckle::recording {

/// The loop reads it; all others it writes.
[[nodiscard]] bool is_input(WireEventKind kind) noexcept;

/// One wire within one step: what was read, and what was written, each in its order. Allocates.
class ReplayedWire {
 public:
  /// Begins a step.
  void begin() noexcept;
  void add_input(const WireEvent& event) { inputs_.push_back(event); }
  void add_output(const WireEvent& event) { outputs_.push_back(event); }

  /// The next input, where it is of this kind.
  [[nodiscard]] const WireEvent* take(WireEventKind kind) noexcept;
  /// Whatever the wire said of itself just then; the same as before where it said nothing.
  [[nodiscard]] std::uint32_t take_state(WireEventKind kind, std::uint32_t& state) noexcept;
  /// The loop writes. @return whether the recorded one's write succeeded.
  bool write(WireEventKind sent, std::uint32_t value, std::span<const std::uint8_t> data);
  /// After the step: adds what differs, in words.
  void end(std::vector<std::string>& differences);

 private:
  std::vector<WireEvent> inputs_, outputs_;
  std::size_t read_ = 0, written_ = 0;
  std::vector<std::string> differences_;
};

class ReplayedWires {
 public:
  /// Deals the events out to the wires. MachineStatus, which is no loop's own, is left out.
  void begin(const StepWires& wires);
  /// After the loop's step. @return what it wrote otherwise than the recorded one, or did not read.
  [[nodiscard]] std::vector<std::string> end();

  [[nodiscard]] CanBus& can() noexcept { return can_; }
  [[nodiscard]] HidPort& hid() noexcept { return hid_; }
  [[nodiscard]] Link& link() noexcept { return link_; }

 private:
  class Can final : public CanBus {
   public:
    explicit Can(ReplayedWire& wire) noexcept : wire_(wire) {}
    bool send(const CanFrame& frame) noexcept override;
    bool receive(CanFrame& frame) noexcept override;
    [[nodiscard]] CanState state() const noexcept override;
    [[nodiscard]] std::array<CanState, 2> states() const noexcept override { return can_states(state_); }
    void acknowledge() noexcept override;

   private:
    ReplayedWire& wire_;
    mutable std::uint32_t state_ = 0;
  };
  class Hid final : public HidPort {
   public:
    explicit Hid(ReplayedWire& wire) noexcept : wire_(wire) {}
    bool write(const HidReport& report) noexcept override;
    bool read(HidReport& report) noexcept override;
    [[nodiscard]] bool connected() const noexcept override;

   private:
    ReplayedWire& wire_;
    mutable std::uint32_t connected_ = 0;
  };
  class LinkEnd final : public Link {
   public:
    explicit LinkEnd(ReplayedWire& wire) noexcept : wire_(wire) {}
    bool send(std::span<const std::uint8_t> bytes) noexcept override;
    bool receive(Datagram& datagram) noexcept override;
    [[nodiscard]] bool emptied() const noexcept override;

   private:
    ReplayedWire& wire_;
    mutable std::uint32_t not_emptied_ = 0;
  };

  std::array<ReplayedWire, 3> wires_;
  Can can_{wires_[0]};
  Hid hid_{wires_[1]};
  LinkEnd link_{wires_[2]};
};

}  // namespace knuckle::recording
