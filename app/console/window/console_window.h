// The console's window as a whole: takes keys in, draws the screens, says what the person asks for.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/console/alarm_sounds.h"
#include "app/console/event_book.h"
#include "app/console/hand_input.h"
#include "app/console/keys.h"
#include "app/console/picture/layer.h"
#include "app/console/picture/machine_panel.h"
#include "app/console/picture/simulated_camera.h"
#include "app/console/screens/console_data.h"
#include "app/console/screens/player_panel.h"
#include "app/console/screens/ui_state.h"
#include "app/console/window/window.h"
#include "video/sound_player.h"

namespace knuckle::console::window {

class ConsoleWindow {
 public:
  /// @throws InputError as Window does.
  ConsoleWindow(const WindowOptions& options, screens::ConsoleFacts facts);

  [[nodiscard]] bool closing() const { return window_.closing(); }
  /// The gamepad that leads, as in the newest frame: none, and nothing of it is held.
  void take_gamepad(const std::optional<GamepadState>& state);
  /// The world of the simulated session on screen.
  void show_world(const sim::WorldDescription& world);
  /// One on the simulated machine. @param mount of the machine's own.
  void add_simulated_camera(const CameraDescription& mount);
  /// From now on a recording is shown, and nothing that is live. @param player outlives this.
  void play(screens::PlayerPanel& player) { player_ = &player; }
  /// One frame of it, yet to be shown.
  void frame_of_player();
  /// From now on alarms are heard, unless the person turns them off. @param muted they are turned off at first.
  void make_sounds(bool muted);
  /// Where the machine was drawn last; nullopt: nowhere.
  [[nodiscard]] const std::optional<Area>& machine_picture() const noexcept { return machine_picture_; }
  /// For the light on every screen.
  void show_recording(RecordingLight light) { recording_ = std::move(light); }
  /// Takes a view into histories and totals without drawing it.
  void watch(const ConsoleView& view);
  /// The same, and one frame of it, yet to be shown: of it all, or of a camera's new picture alone, under what is
  /// there.
  /// @param view_age_s since the loops last put a view.
  void frame(const ConsoleView& view, const LoopHealth& loop, EventBook& events, double view_age_s);
  /// Shows the frame drawn and waits until the next is due.
  void show();
  /// Rung for each picture of a camera: the next frame is drawn at once.
  [[nodiscard]] const std::shared_ptr<video::Bell>& bell() const noexcept { return bell_; }
  /// What the person asks for now; nothing while a recording is shown. @param now of the loops' clock.
  [[nodiscard]] ConsoleInput input(Time now) const;
  /// The frame drawn last, as PNG. @throws InputError where the file cannot be written.
  void write_png(const std::string& path) const { window_.write_png(path); }

  [[nodiscard]] const screens::ConsoleFacts& facts() const noexcept { return facts_; }
  [[nodiscard]] screens::UiState& state() noexcept { return state_; }
  /// Of a session that runs.
  [[nodiscard]] screens::LivePlots& live_plots() noexcept { return live_plots_; }
  /// To be filled before the first frame.
  [[nodiscard]] screens::CameraPane& cameras() noexcept { return cameras_; }
  [[nodiscard]] Window& window() noexcept { return window_; }
  /// Nothing flashes: for pictures.
  void hold_steady() noexcept { steady_ = true; }

 private:
  void take_keys();
  void sound(const ConsoleView& view, EventBook& events, double view_age_s);
  void draw_pictures(const Area& machine, const std::optional<picture::Grid>& grid, bool stale,
                     const ConsoleView& view);
  void note_picture(Time received);
  [[nodiscard]] bool draw_picture_only();
  void align_camera(const ConsoleView& view, EventBook& events);
  void act(const KeyBinding& binding);
  void act_on_player(KeyAction action);
  void draw(const ConsoleView& view, const LoopHealth& loop, EventBook& events, double view_age_s);
  void draw_too_small(const ConsoleView& view);
  [[nodiscard]] HeldKeys held_keys() const;

  screens::ConsoleFacts facts_;
  Window window_;
  screens::UiState state_;
  FocusOrder focus_;
  Kinematics kinematics_;
  screens::LivePlots live_plots_;
  screens::Kept kept_{facts_.machine};
  JointLoads loads_;  ///< Of the newest view of a session that runs.
  PushWatch push_watch_;
  picture::MachinePanel machine_;
  std::optional<Area> machine_picture_;
  std::vector<std::shared_ptr<picture::SimulatedCamera>> simulated_cameras_;
  AlarmWatch alarms_;
  std::unique_ptr<video::SoundPlayer> sounds_;
  HandInput gamepad_;
  /// A finger that stayed on enable while its gamepad was gone, or while text was typed, has not pressed it.
  bool keys_enable_was_up_ = false, pad_enable_was_up_ = false;
  bool pointer_may_enable_ = false;  ///< Its press, if there is one, began with Hold to run on, in the side view.
  bool pad_came_back_ = false;       ///< And its bumper was not down since.
  screens::CameraPane cameras_;
  RecordingLight recording_;
  screens::PlayerPanel* player_ = nullptr;
  std::shared_ptr<video::Bell> bell_ = std::make_shared<video::Bell>();
  picture::Layer over_picture_;  ///< What lies over the picture that fills the pane, as it was drawn last.
  bool layered_ = false;         ///< It does, as of the last whole frame.
  /// What must not be missed: where any of it has changed, the whole is drawn.
  struct Standing {
    Mode mode = Mode::kOff;
    std::uint16_t limits = 0;
    bool contact = false, stale = false;
    std::size_t open_alarms = 0;
    bool operator==(const Standing&) const = default;
  };
  Standing drawn_stands_;
  Time picture_at_ = kNever;   ///< When the last one was there.
  Duration picture_period_{};  ///< Between it and the one before.
  bool steady_ = false;
  bool align_asked_ = false;
  std::optional<KeyAction> live_jump_;  ///< Asked for since the frame before.
  double zoom_ = 0;                     ///< Steps that keys have asked for since the frame before.
  double drawn_s_ = 0;                  ///< Time of the session drawn last.
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace knuckle::console::window
