// The operator's end of the link, through which a machine is led only once the far end has told that it drives that
// machine: until then every message says that nobody holds the device, so it never engages.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "app/programs/letting_go.h"
#include "core/reason.h"
#include "core/time.h"
#include "transport/link.h"
#include "transport/machine_status.h"
#include "transport/status_link.h"

namespace knuckle::programs {

class SameMachineLink final : public Link {
 public:
  /// @param machine that is led here, by name. @param link outlives this.
  SameMachineLink(std::string_view machine, Link& link) noexcept : here_(machine), status_(link) { nobody_.let_go(); }

  /// Each step, before anything is received.
  void stamp(Time now) noexcept {
    now_ = now;
    status_.stamp(now);
  }
  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    return same() ? status_.send(bytes) : nobody_.send(bytes);
  }
  bool receive(Datagram& datagram) noexcept override {
    const bool heard = status_.receive(datagram);
    if (heard && heard_at_ == kNever) heard_at_ = now_;
    return heard;
  }

  /// What the far end told of itself: see StatusLink.
  [[nodiscard]] const std::optional<MachineStatus>& status() const noexcept { return status_.status(); }
  [[nodiscard]] Time status_at() const noexcept { return status_.status_at(); }
  [[nodiscard]] const MachineName& here() const noexcept { return here_; }
  [[nodiscard]] bool same() const noexcept { return status() && status()->machine == here_; }
  /// Why the far end cannot be led from here; kNone where it can, and before it has had time to tell.
  [[nodiscard]] Reason reason() const noexcept {
    if (same()) return {};
    if (status()) return {ReasonCode::kOtherMachine, 0, 0, 0};
    const bool silent = heard_at_ != kNever && now_ - heard_at_ > kTimeToTell;
    return {silent ? ReasonCode::kMachineNotTold : ReasonCode::kNone, 0, 0, 0};
  }

 private:
  static constexpr Duration kTimeToTell = 1s;  // twenty times what it takes

  MachineName here_;
  StatusLink status_;
  LettingGoLink nobody_{status_};
  Time now_{}, heard_at_ = kNever;
};

}  // namespace knuckle::programs
