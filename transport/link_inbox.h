// Reads a link step by step: a bounded number of datagrams each, and when they arrived by the reader's clock.
#pragma once

#include <algorithm>

#include "core/time.h"
#include "transport/link.h"

namespace knuckle {

class LinkInbox {
 public:
  static constexpr int kMostDatagrams = 64;  ///< A step: a flood is cut off, not followed.

  explicit LinkInbox(Link& link) noexcept : link_(link) {}

  void begin_step(Time now) noexcept {
    now_ = now;
    left_ = kMostDatagrams;
  }
  /// The next one of this step.
  bool next(Datagram& datagram) noexcept {
    if (left_ == 0) return false;
    --left_;
    if (link_.receive(datagram)) return true;
    if (link_.emptied()) emptied_at_ = now_;
    return false;
  }
  /// When it came to this computer. The wire measures how long it waited by a clock that may be set meanwhile; what was
  /// not there when all had been read has come since. Never after now, though the reader's clock may be set back.
  [[nodiscard]] Time arrival(const Datagram& datagram) const noexcept {
    return now_ - std::max(Duration::zero(), std::min(datagram.waited, now_ - emptied_at_));
  }

 private:
  Link& link_;
  Time now_{}, emptied_at_ = kNever;
  int left_ = 0;
};

}  // namespace knuckle
