// A link on the operator's side that sorts out what the machine tells of itself: nobody behind it sees a MachineStatus.
#pragma once

#include <optional>

#include "core/time.h"
#include "transport/link.h"
#include "transport/link_messages.h"
#include "transport/machine_status.h"

namespace knuckle {

class StatusLink final : public Link {
 public:
  /// @param link outlives this.
  explicit StatusLink(Link& link) noexcept : link_(link) {}

  /// Time that arrivals get from now on: of the step that takes them.
  void stamp(Time now) noexcept { now_ = now; }
  bool send(std::span<const std::uint8_t> bytes) noexcept override { return link_.send(bytes); }
  bool receive(Datagram& datagram) noexcept override {
    for (int i = 0; i < kMostInARow && link_.receive(datagram); ++i) {
      const auto status = decode_status(datagram.view());
      if (!status) return true;
      keep(*status);
    }
    return false;
  }

  /// Newest by its number; nothing before the first.
  [[nodiscard]] const std::optional<MachineStatus>& status() const noexcept { return status_; }
  [[nodiscard]] Time status_at() const noexcept { return status_at_; }  ///< Its arrival; kNever before the first.

 private:
  static constexpr int kMostInARow = 64;  // nobody can keep a loop busy

  void keep(const MachineStatus& status) noexcept {
    const bool may_have_restarted = now_ - status_at_ >= kRestartSilence;
    if (status_ && !newer(status.sequence, status_->sequence) && !may_have_restarted) return;
    status_ = status;
    status_at_ = now_;
  }

  Link& link_;
  Time now_{};
  std::optional<MachineStatus> status_;
  Time status_at_ = kNever;
};

}  // namespace knuckle
