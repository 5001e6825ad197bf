// What a screen is drawn from: the newest view and what does not change while the window is open.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/console/console_view.h"
#include "app/console/event_book.h"
#include "app/console/hand_input.h"
#include "app/console/joint_load.h"
#include "app/console/link_watch.h"
#include "app/console/picture/machine_panel.h"
#include "app/console/screens/camera_pane.h"
#include "app/console/screens/measures.h"
#include "app/console/screens/plot_window.h"
#include "app/console/widgets/widgets.h"
#include "core/loop_health.h"
#include "core/time.h"
#include "machine/description.h"
#include "machine/device_description.h"
#include "transport/link_messages.h"

namespace knuckle::console::screens {

// How much has been carried away: each load once, when it is released.

/// The estimate says more than that something may hang there.
[[nodiscard]] bool payload_is_known(const SlaveMessage& machine, double full_scale_kg) noexcept;

/// What counts as a load, of what the machine carries in full.
inline constexpr double kLeastLoad = 0.05;

class PayloadTotal {
 public:
  /// @param least_kg what counts as a load on this machine.
  explicit PayloadTotal(double least_kg) : least_kg_(least_kg) {}
  /// Only for current values: not to be called while no packets are received.
  void watch(const SlaveMessage& machine, Time now);
  void clear();
  [[nodiscard]] double total_kg() const noexcept { return total_kg_; }
  [[nodiscard]] int loads() const noexcept { return loads_; }

 private:
  double least_kg_;
  double total_kg_ = 0, load_kg_ = 0, load_sigma_kg_ = 0;
  int loads_ = 0;
  bool carrying_ = false;
  Time since_ = kNever, seen_ = kNever;  ///< Carried, or released.
};

/// What a console keeps of a session beside its plots and events.
struct Kept {
  explicit Kept(const MachineDescription& machine) : payload(kLeastLoad * machine.payload_full_scale_kg) {}
  PayloadTotal payload;
  ContactTrail contacts;
  LinkHistory link;
};

class PlayerPanel;

struct ConsoleFacts {
  MachineDescription machine;
  DeviceDescription device;
  HandSource hand = HandSource::kKeyboard;
  std::uint64_t seed = 1;              ///< Of the simulated machine.
  std::string peer;                    ///< "simulated", or address and port of the machine's side.
  std::vector<std::string> scenarios;  ///< That a simulated session can be begun with.
  std::int64_t unix_ns_at_zero = 0;    ///< Of session time 0; 0: a simulated session, which does not run by the clock.
};

struct ConsoleData {
  const ConsoleFacts& facts;
  const Kinematics& kinematics;
  const ConsoleView& view;
  const JointLoads& loads;  ///< Of the view, marked by a PushWatch; none where what was measured is old.
  const LoopHealth& loop;
  PlotWindow& plots;
  LivePlots& live_plots;  ///< Of a session that runs: what was shown in plots before.
  const Kept& kept;
  const picture::MachinePanel& machine;  ///< The picture of it.
  EventBook& events;
  CameraPane& cameras;
  const RecordingLight& recording;
  PlayerPanel* player = nullptr;  ///< What is shown is a recording; nullptr: it happens now.
};

/// The time that plots and events are looked at: of a recording its cursor; of what runs, once one was chosen.
[[nodiscard]] std::optional<Time> chosen_time(const ConsoleData& data);
void choose_time(const ConsoleData& data, Time at);

/// How fresh the machine's newest message is, and its status beside it.
[[nodiscard]] inline Freshness machine_freshness(const ConsoleView& view) {
  return {view.link.heard, view.link.silence_s, kLinkLost_s};
}
/// How fresh what its sensors say is: pose, pressures, force, payload. A machine whose sensors are mute goes on sending
/// their last values.
[[nodiscard]] inline Freshness measured_freshness(const ConsoleView& view) {
  const SlaveMessage& m = view.machine;
  Freshness fresh = machine_freshness(view).after(std::max(0.0, to_seconds(m.stamp.sent_at - m.sensor_at)));
  fresh.heard = fresh.heard && m.sensor_at >= Time{};
  return fresh;
}
/// Not marked yet.
[[nodiscard]] inline JointLoads measured_loads(const ConsoleView& view, const MachineDescription& machine,
                                               const Kinematics& kinematics) {
  return measured_freshness(view).stale() ? JointLoads{} : joint_loads(view.machine, machine, kinematics);
}
[[nodiscard]] inline Freshness status_freshness(const ConsoleView& view) {
  constexpr double kLimit_s = 0.5;  // sent 20 times a second
  return {view.status_heard, view.status_age_s, kLimit_s};
}
/// The same of valve commands, spools and why the force is not known better.
[[nodiscard]] inline Freshness valves_freshness(const ConsoleView& view) {
  return view.status_of_steps ? machine_freshness(view) : status_freshness(view);
}

}  // namespace knuckle::console::screens
