#include "transport/link_session.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <random>
#include <string>

#include "core/error.h"

namespace knuckle {

namespace {

LinkStart start_of(std::uint64_t session, std::uint64_t origin) noexcept {
  constexpr int kOriginBits = 57;
  return {session == 0 ? 1 : session, Duration(static_cast<std::int64_t>(origin >> (64 - kOriginBits)))};
}

}  // namespace

LinkStart random_start() {
  std::array<std::uint64_t, 2> drawn{};
  if (::getrandom(drawn.data(), sizeof drawn, 0) != static_cast<ssize_t>(sizeof drawn))
    throw InputError(std::string("link: the system gives no random numbers: ") + std::strerror(errno));
  return start_of(drawn[0], drawn[1]);
}

LinkStart start_from(std::uint64_t seed, LinkEnd end) noexcept {
  std::mt19937_64 random(4 * seed + static_cast<std::uint64_t>(end));
  const std::uint64_t session = random();
  return start_of(session, random());
}

Duration AboveLeast::step(Duration value, Time now) noexcept {
  if (const Duration passed = now - since_; passed >= kInterval) {
    before_ = passed < 2 * kInterval ? least_ : value;
    least_ = value;
    since_ = now;
  }
  least_ = std::min(least_, value);
  return value - std::min(least_, before_);
}

bool LinkSession::of_far(const LinkStamp& stamp) const noexcept {
  return followed_.session != 0 && stamp.session == followed_.session && stamp.echoed_session == own_.session;
}

bool LinkSession::begins(const LinkStamp& stamp, Time arrived) const noexcept {
  const bool free = followed_.session == 0 || arrived - followed_.at >= silence_;
  return free && stamp.session != 0 && stamp.echoed_session == own_.session && arrived - stamp.echoed <= kOldestEcho &&
         stamp.echoed > newest_echo_ + kMostHeld;
}

LinkSession::Verdict LinkSession::take(LinkStamp& stamp, Time arrived) noexcept {
  stamp.echoed = stamp.echoed_session == own_.session ? from_link(stamp.echoed) : kNever;
  // Nothing can echo what has not been sent: a little is left for what comes in while a step is under way.
  if (stamp.echoed > arrived + kMostHeld) {
    stamp.echoed_session = 0;
    stamp.echoed = kNever;
  }
  const bool same = of_far(stamp);
  const bool first = !same && stamp.session != followed_.session && begins(stamp, arrived);
  if (!same && !first) {
    if (stamp.session != followed_.session) stranger_ = {stamp.session, stamp.sequence, stamp.sent_at, arrived};
    return Verdict::kForeign;
  }
  if (same && !newer(stamp.sequence, followed_.sequence)) return Verdict::kOld;
  if (first) offset_ = round_trip_ = {};
  followed_ = {stamp.session, stamp.sequence, stamp.sent_at, arrived};
  newest_echo_ = std::max(newest_echo_, stamp.echoed);
  late_ = std::min(offset_.step(arrived - stamp.sent_at, arrived), round_trip_.step(arrived - stamp.echoed, arrived));
  return first ? Verdict::kBegins : Verdict::kNews;
}

LinkStamp LinkSession::stamp(std::uint32_t sequence, Time now) const noexcept {
  // Who may begin a session next has to know that it is heard.
  const bool silent = followed_.session == 0 || now - followed_.at >= silence_;
  const Heard& heard = silent && stranger_.at > followed_.at ? stranger_ : followed_;
  LinkStamp stamp{own_.session, heard.session, sequence, to_link(now), {}};
  if (heard.session != 0) stamp.echoed = heard.sent_at + std::min(now - heard.at, kMostHeld);
  return stamp;
}

}  // namespace knuckle
