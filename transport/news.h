// Which messages of the other side are news. While it is heard, its numbers tell. After a silence they do not: the
// other side may have begun anew from 1, and a copy that the network kept back has an old number as well; nor do its
// stamps, whose clock may have begun anew, too. What tells is the echo: each side sends back the newest stamp it has
// heard plus the time since (at most kMostHeld). Stamps only grow, so a sender's earlier message echoes at most
// kMostHeld more than its later ones. Whoever began anew has heard something since that no earlier message can have
// known.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/time.h"
#include "transport/link_messages.h"

namespace knuckle {

class News {
 public:
  /// @param message MasterMessage or SlaveMessage. @param echoed what it says of our own stamps; Time{}: nothing heard.
  /// @param silent so long nothing was news that the other side may have begun anew.
  /// @return whether it is newer than all that was taken so far; it is taken then.
  template <typename Message>
  bool take(const Message& message, Time echoed, Time now, bool silent) noexcept {
    // What we have not sent yet was a former life of ours: such an echo tells nothing.
    const bool known = echoed > Time{} && echoed <= now;
    const bool follows = newer(message.sequence, sequence_) && message.sent_at >= sent_at_ &&
                         (first_echo_ == Time{} || echoed >= first_echo_ - kMostHeld);
    const bool begins_anew = silent && known && echoed > newest_echo_ + kMostHeld;
    if (heard_ && !follows && !begins_anew) return false;
    if (!heard_ || !follows) first_echo_ = newest_echo_ = Time{};
    heard_ = true;
    sequence_ = message.sequence;
    sent_at_ = message.sent_at;
    if (!known) return true;
    if (first_echo_ == Time{}) first_echo_ = echoed;
    newest_echo_ = std::max(newest_echo_, echoed);
    return true;
  }

 private:
  bool heard_ = false;
  std::uint32_t sequence_ = 0;         // of the newest message, ...
  Time sent_at_{};                     // ... its sender's clock
  Time first_echo_{}, newest_echo_{};  // of this life of the sender; Time{}: it has not heard us yet
};

}  // namespace knuckle
