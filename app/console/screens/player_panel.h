// What the screens show while a recording is played: the run at its cursor, the window of its plots, and another run
// beside it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/console/event_book.h"
#include "app/console/joint_load.h"
#include "app/console/link_watch.h"
#include "app/console/player/load.h"
#include "app/console/player/run.h"
#include "app/console/screens/console_data.h"
#include "app/console/screens/measures.h"
#include "app/console/screens/plot_window.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::console::screens {

// What a console keeps of a session while it runs, for any time of a recording: loads carried, places of contact, the
// minutes of the link. The whole recording is looked at once, as often as a window would.

class KeptOfRun {
 public:
  KeptOfRun(const player::Run& run, const MachineDescription& machine, const Kinematics& kinematics);

  /// Shows what a console that was there from the beginning has kept by this time.
  void show(Time at);

  [[nodiscard]] const Kept& shown() const noexcept { return kept_; }

 private:
  struct Load {
    Time at{};
    PayloadTotal total;
  };
  struct Look {
    Time at{};
    LinkValues values{};
  };
  void show_contacts(Time at);
  void show_link(Time at);

  std::vector<Load> loads_;  ///< Whenever it changed.
  std::vector<ContactTrail::Touch> touches_;
  std::vector<Look> looks_;
  Kept kept_;
  Time link_at_ = kNever;
};

/// Another run on the same time line.
struct Beside {
  std::string name;  ///< "re-run", or a file's.
  player::Run run;
  Duration later{};                  ///< Its times minus those of the run on the time line.
  std::vector<std::string> differs;  ///< Where the two first differ, in words, or that they do not.
  std::optional<Time> differs_at;    ///< On the time line.
};

class PlayerPanel {
 public:
  /// @throws InputError as Kinematics does.
  PlayerPanel(player::Played played, std::optional<Beside> beside);
  PlayerPanel(const PlayerPanel&) = delete;
  PlayerPanel& operator=(const PlayerPanel&) = delete;

  /// Every frame: time passes, and what is shown follows the cursor.
  void pass(double seconds);

  [[nodiscard]] const player::Played& played() const noexcept { return played_; }
  [[nodiscard]] player::Timeline& timeline() noexcept { return timeline_; }
  [[nodiscard]] const player::Timeline& timeline() const noexcept { return timeline_; }
  [[nodiscard]] const std::optional<Beside>& beside() const noexcept { return beside_; }
  /// As of the last pass().
  [[nodiscard]] const ConsoleView& view() const noexcept { return view_; }
  /// Of the same, as a window had them that was there in the time before.
  [[nodiscard]] const JointLoads& loads() const noexcept { return loads_; }
  /// nullptr: nothing is beside, or not at this time.
  [[nodiscard]] const ConsoleView* beside_view() const noexcept { return beside_here_ ? &beside_view_ : nullptr; }
  /// The ten seconds around the cursor; a click moves the time line at the next pass().
  [[nodiscard]] PlotWindow& plots() noexcept { return plots_; }
  /// As a console that was there from the beginning on had it at the cursor.
  [[nodiscard]] const Kept& kept() const noexcept { return kept_.shown(); }
  /// All of it: those to come, too.
  [[nodiscard]] EventBook& events() noexcept { return events_; }
  /// Nothing was recorded at the cursor.
  [[nodiscard]] bool in_gap() const noexcept;

 private:
  void show_loads(Time at);
  [[nodiscard]] History::Sample sample(const player::Run& run, Time at) const;

  player::Played played_;
  std::optional<Beside> beside_;
  Kinematics kinematics_;
  player::Timeline timeline_;
  EventBook events_;
  KeptOfRun kept_;
  ConsoleView view_, beside_view_;
  JointLoads loads_;
  bool beside_here_ = false;
  std::optional<Time> shown_;
  PlotWindow plots_;
};

}  // namespace knuckle::console::screens
