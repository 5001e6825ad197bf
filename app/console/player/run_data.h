// What the player holds of one run of a session, recorded, or its loops run again: all of it decoded into a few compact
// rows (about 150 kB a second with both sides), so that no file is read while it plays. NaN: not recorded.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <vector>

#include "app/console/console_view.h"
#include "app/console/link_watch.h"
#include "core/reason.h"
#include "core/time.h"
#include "master/master_state.h"
#include "slave/slave_state.h"
#include "transport/link_messages.h"
#include "transport/machine_readings.h"
#include "transport/machine_status.h"

namespace knuckle::console::player {

inline constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

/// What stands for many steps of the operator's side.
struct HandStanding {
  bool heard = false;
  OperatorSide hand;  ///< But for what each step has of its own.
};

/// The operator's side in one step of a loop that knows of it.
struct HandStep {
  Time at{};
  Eigen::Vector3f set_point_rad = Eigen::Vector3f::Constant(kUnknown);
  Eigen::Vector2f sent_force_N = Eigen::Vector2f::Constant(kUnknown);
  float hand_energy_J = kUnknown, round_trip_s = kUnknown, silence_s = kUnknown;
  std::uint32_t standing = 0;  ///< Index into RunData::standings.
};

/// What the machine's side told in one step. Of a table's length that no angle gives the angle before it, at first 0.
struct MachineStep {
  Time at{};  ///< Of its step; where that side is not recorded, of the arrival.
  SlaveMessage told;
  // Where the machine's side is recorded:
  Eigen::Vector3f command = Eigen::Vector3f::Constant(kUnknown), spool = command;  ///< [-1, 1]
  bool pilot_on = false;
  std::uint16_t force_doubts = 0;  ///< estimation::ConfidenceReason bits.
};

/// From when on a message of the machine's was the newest at the operator's side.
struct Receipt {
  Time at{};
  std::uint32_t sequence = 0;
};
/// Every message of the machine's that came in at the operator's side, copies and overtaken ones included.
struct Arrival {
  Time at{}, echoed{};  ///< By the operator's clock.
  std::uint32_t sequence = 0;
  std::uint64_t session = 0;
};
struct StatusRow {
  Time at{};  ///< Of its arrival; at the machine's side, of its sending.
  MachineStatus status;
  MachineReadings readings;  ///< As told until then.
};

/// Steps between these two are missing.
struct Gap {
  Time from{}, to{};
};

/// Each in the order of its times.
struct RunData {
  bool operator_side = false, machine_side = false;  ///< Whose loop's steps are in it.
  bool sensors_alone = false;                        ///< An imported table: no loop ran.
  Duration machine_period = 5ms;
  double position_scale = double{kUnknown}, force_scale = double{kUnknown};  ///< Of the device's file.
  std::vector<HandStanding> standings;
  std::vector<HandStep> hand;
  std::vector<MachineStep> machine;
  std::vector<Receipt> receipts;
  std::vector<Arrival> arrivals;
  std::vector<StatusRow> statuses;
  std::vector<Gap> operator_holes, machine_holes;  ///< From one step with recorded wires to the next, where some of
                                                   ///< the steps between have none.

  // What is not later than the one before is left out: rows are searched by their times.
  void add(const master::MasterState& state);
  /// @param told in this step; nullptr: nothing that is recorded.
  void add(const slave::SlaveState& state, const SlaveMessage* told);
  /// As the operator's side took it, where the machine's side itself is not recorded.
  void add(Time arrived, const SlaveMessage& message);

 private:
  /// @param step without what it shares with others.
  void add(HandStep step, HandStanding standing);
};

// Finding in rows that are in the order of their times.

/// The first one that is later.
template <typename Row>
auto first_after(const std::vector<Row>& rows, Time at) noexcept {
  return std::upper_bound(rows.begin(), rows.end(), at, [](Time t, const Row& row) { return t < row.at; });
}
/// The first one that is not earlier.
template <typename Row>
auto first_from(const std::vector<Row>& rows, Time at) noexcept {
  return std::lower_bound(rows.begin(), rows.end(), at, [](const Row& row, Time t) { return row.at < t; });
}
/// The last one that is not later; nullptr: there is none.
template <typename Row>
const Row* newest(const std::vector<Row>& rows, Time at) noexcept {
  const auto later = first_after(rows, at);
  return later == rows.begin() ? nullptr : &*std::prev(later);
}
template <typename Row>
std::optional<Time> after(const std::vector<Row>& rows, Time at) noexcept {
  const auto later = first_after(rows, at);
  return later == rows.end() ? std::nullopt : std::optional(later->at);
}
template <typename Row>
std::optional<Time> before(const std::vector<Row>& rows, Time at) noexcept {
  const auto not_before = first_from(rows, at);
  return not_before == rows.begin() ? std::nullopt : std::optional(std::prev(not_before)->at);
}

// The link of a recorded operator's side, watched anew message by message.

class LinkFeed {
 public:
  /// @param data outlives this. @param from what came before is not counted.
  LinkFeed(const RunData& data, Time from);

  /// Takes in what came up to this time, which is later than that of the call before.
  void pass(Time at) noexcept;
  /// Puts in what the ten seconds before were.
  void show(LinkSide& link) const noexcept { watch_.show(link); }

 private:
  void take_statuses(Time before) noexcept;

  const RunData& data_;
  LinkWatch watch_;
  std::size_t arrival_, status_;  ///< The next of each.
};

}  // namespace knuckle::console::player
