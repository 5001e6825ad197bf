// One side's end of the conversation over the link: whom it follows, what of that is news, how late it came, and the
// stamp of what is sent back.
//
// Each side draws a session number and the origin of its time stamps anew at every start. Every message
// carries its sender's session and, as an echo, session and time of the newest message that the sender has heard. An
// echo of this side's own session can only come from somebody who has heard this side since it started: a recording of
// an earlier session cannot have it.
#pragma once

#include <cstdint>

#include "core/time.h"
#include "transport/link_header.h"

namespace knuckle {

// What a side of the link draws at its start: a number by which it is told from its earlier runs, and where its time
// stamps begin. Loops are given it; only programs draw.

struct LinkStart {
  std::uint64_t session = 0;  ///< Not 0: nobody follows that one.
  Duration origin{};          ///< Added to the sender's clock in every stamp; up to 4.6 years.
};

/// From the operating system's random numbers. @throws InputError where there are none.
[[nodiscard]] LinkStart random_start();

/// The ends of a session on virtual time.
enum class LinkEnd : std::uint8_t { kOperator = 1, kMachine = 2 };
/// The same for the same seed.
[[nodiscard]] LinkStart start_from(std::uint64_t seed, LinkEnd end) noexcept;

/// How far a duration is above the least one of the last one to two intervals. So a step of a clock is forgotten after
/// two intervals.
class AboveLeast {
 public:
  /// Delays that grow by less than the loss policy's limit within two of it count as the path's, not as the message's.
  static constexpr Duration kInterval = 250ms;
  /// @return value - least, not negative.
  Duration step(Duration value, Time now) noexcept;

 private:
  Time since_ = kNever;
  Duration least_{}, before_{};  // of this interval, and of the one before
};

class LinkSession {
 public:
  /// An echo that is older than this begins no session.
  static constexpr Duration kOldestEcho = 5s;

  /// @param silence after which the far side may have restarted.
  LinkSession(const LinkStart& own, Duration silence) noexcept : own_(own), silence_(silence) {}

  enum class Verdict : std::uint8_t {
    kForeign,  ///< Of a session that is not followed, or of one that has not heard this side: nothing may act on it.
    kOld,      ///< A copy, or overtaken by a newer one.
    kNews,
    kBegins,  ///< News, and the first of a new session of the far side: everything has to be agreed on anew.
  };
  /// Judges a message that came in at `arrived`, and translates its echo into this side's own clock; kNever where it
  /// does not echo this session.
  /// A session is followed from the first message on that echoes this one with a stamp that no message of the session
  /// followed so far can have; while that one is heard, no other begins.
  Verdict take(LinkStamp& stamp, Time arrived) noexcept;

  /// By how much the newest message was later than the quickest recent one. The clocks of both sides need not agree: it
  /// is the smaller of two increases, that of arrival minus stamp and that of the round trip. So neither a step of the
  /// far clock nor a delay on the way there counts.
  [[nodiscard]] Duration late() const noexcept { return late_; }

  /// Of a message that leaves now.
  [[nodiscard]] LinkStamp stamp(std::uint32_t sequence, Time now) const noexcept;

  // Other times in messages: kNever stays kNever.
  [[nodiscard]] Time to_link(Time own) const noexcept { return own == kNever ? kNever : own + own_.origin; }
  [[nodiscard]] Time from_link(Time echoed) const noexcept { return echoed == kNever ? kNever : echoed - own_.origin; }

  /// Of the far side; 0: none is followed yet.
  [[nodiscard]] std::uint64_t far() const noexcept { return followed_.session; }
  /// Whether a message is of the session that is followed, and has heard this one.
  [[nodiscard]] bool of_far(const LinkStamp& stamp) const noexcept;

 private:
  struct Heard {
    std::uint64_t session = 0;  // 0: nobody
    std::uint32_t sequence = 0;
    Time sent_at{};    // sender's stamp
    Time at = kNever;  // arrival
  };
  [[nodiscard]] bool begins(const LinkStamp& stamp, Time arrived) const noexcept;

  LinkStart own_;
  Duration silence_;
  Heard followed_, stranger_;  // stranger_: the newest of another session, which learns by the echo that it is heard
  Time newest_echo_ = kNever;  // of all that was followed, own clock
  AboveLeast offset_, round_trip_;
  Duration late_{};
};

}  // namespace knuckle
