#include "transport/watched_can.h"

namespace knuckle {

WatchedCan::WatchedCan(CanBus& bus, std::uint32_t bit_rate, bool recording)
    : bus_(bus), bit_rate_(bit_rate), copies_(recording ? std::make_unique<Copies>() : nullptr) {}

double WatchedCan::take_load(Time now) noexcept {
  const double share = since_ == kNever || now <= since_
                           ? 0
                           : static_cast<double>(bits_) / (to_seconds(now - since_) * static_cast<double>(bit_rate_));
  since_ = now;
  bits_ = 0;
  return share;
}

void WatchedCan::write(std::ostream& out, const std::string& interface) {
  TimedFrame passed;
  while (copies_ && copies_->pop(passed)) out << candump_line(passed.at, passed.frame, interface.c_str()) << '\n';
}

}  // namespace knuckle
