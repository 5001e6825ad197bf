#include "app/console/player/link_feed.h"

#include "app/console/player/rows.h"

namespace knuckle::console::player {

LinkFeed::LinkFeed(const RunData& data, Time from)
    : data_(data),
      watch_(data.machine_period),
      arrival_(static_cast<std::size_t>(first_from(data.arrivals, from) - data.arrivals.begin())),
      status_(static_cast<std::size_t>(first_from(data.statuses, from) - data.statuses.begin())) {}

void LinkFeed::take_statuses(Time before) noexcept {
  for (; status_ < data_.statuses.size() && data_.statuses[status_].at < before; ++status_) {
    watch_.stamp(data_.statuses[status_].at);
    watch_.note(data_.statuses[status_].status);
  }
}

void LinkFeed::pass(Time at) noexcept {
  SlaveMessage message;
  for (; arrival_ < data_.arrivals.size() && data_.arrivals[arrival_].at <= at; ++arrival_) {
    const Arrival& arrival = data_.arrivals[arrival_];
    take_statuses(arrival.at);
    watch_.stamp(arrival.at);
    message.stamp.session = arrival.session;
    message.stamp.sequence = arrival.sequence;
    message.stamp.echoed = arrival.echoed;
    watch_.note(message);
  }
  take_statuses(at + 1ns);
  watch_.stamp(at);
}

void LinkFeed::show(LinkSide& link) const noexcept {
  link.round_trip = watch_.round_trip();
  link.arrival_jitter = watch_.arrival_jitter();
  link.hand_to_valve = watch_.hand_to_valve();
  link.loss = watch_.loss();
}

}  // namespace knuckle::console::player
