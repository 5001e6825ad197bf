// The link of a recorded operator's side, watched anew message by message.
#pragma once

#include <cstddef>

#include "app/console/console_view.h"
#include "app/console/link_watch.h"
#include "app/console/player/run_data.h"

namespace knuckle::console::player {

class LinkFeed {
 public:
  /// @param data outlives this. @param from what came before is not counted.
  LinkFeed(const RunData& data, Time from);

  /// Takes in what came up to this time, which is later than that of the call before.
  void pass(Time at) noexcept;
  /// Puts in what the ten seconds before were.
  void show(LinkSide& link) const noexcept;

 private:
  void take_statuses(Time before) noexcept;

  const RunData& data_;
  LinkWatch watch_;
  std::size_t arrival_, status_;  ///< The next of each.
};

}  // namespace knuckle::console::player
