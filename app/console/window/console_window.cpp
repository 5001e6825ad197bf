#include "app/console/window/console_window.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/cli/output_file.h"
#include "app/console/screens/picture_pane.h"
#include "app/console/screens/screens.h"
#include "core/error.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "video/newest.h"

namespace knuckle::console::window {
namespace {

constexpr int kControl = 2;  // GLFW_MOD_CONTROL
constexpr float kScaleStep = 1.1F;
constexpr double kZoomSteps = 2;  // of the wheel, by a key

/// While something is typed, only these keys act on the console. In a text Space is a blank; Esc still is Stop.
bool acts_in_text(const KeyBinding& binding, bool number) {
  const KeyAction action = binding.action;
  if (action == KeyAction::kStop) return binding.key == GLFW_KEY_ESCAPE || number;
  // Ctrl+Backspace deletes a word there: it must not release Stop.
  return action == KeyAction::kScreen || action == KeyAction::kFullScreen || action == KeyAction::kFocusOn ||
         action == KeyAction::kFocusBack;
}

}  // namespace

ConsoleWindow::ConsoleWindow(const WindowOptions& options, screens::ConsoleFacts facts)
    : facts_(std::move(facts)), window_(options), kinematics_(facts_.machine), machine_(facts_.machine) {
  state_.light = options.light;
  // At first what the machine file lets the tip press with; else well above what work is mostly done with.
  const double ceiling_N = facts_.machine.limits.tip_force_N;
  state_.force_most_N =
      static_cast<float>(ceiling_N > 0 ? ceiling_N : 2.5 * picture::force_scale(facts_.machine).full_N);
}

void ConsoleWindow::show_world(const sim::WorldDescription& world) {
  machine_.begin(world);
  for (const auto& camera : simulated_cameras_) camera->begin(world);
}

void ConsoleWindow::add_simulated_camera(const CameraDescription& mount) {
  const auto pictures = std::make_shared<video::Newest<video::Frame>>();
  const auto give = [pictures, bell = bell_](std::unique_ptr<video::Frame> frame) {
    pictures->put(std::move(frame));
    bell->ring();
  };
  const auto camera = std::make_shared<picture::SimulatedCamera>(facts_.machine, mount, give);
  simulated_cameras_.push_back(camera);
  cameras_.add({mount.name, [pictures] { return pictures->take(); }, [camera] { return camera->status(); }});
}

void ConsoleWindow::watch(const ConsoleView& view) {
  if (view.simulated_s < drawn_s_) {
    kept_.payload.clear();
    kept_.contacts.clear();
  }
  drawn_s_ = view.simulated_s;
  const bool heard = !screens::measured_freshness(view).stale();
  live_plots_.watch(view, heard, !screens::status_freshness(view).stale());
  kept_.link.watch(view);
  machine_.watch(view);
  loads_ = screens::measured_loads(view, facts_.machine, kinematics_);
  push_watch_.watch(loads_, view.now);
  if (!heard) return;
  kept_.payload.watch(view.machine, view.now);
  kept_.contacts.watch(view, kinematics_, reach_m(facts_.machine));
}

void ConsoleWindow::frame(const ConsoleView& view, const LoopHealth& loop, EventBook& events, double view_age_s) {
  watch(view);
  const Duration delay = from_seconds(1e-3 * static_cast<double>(state_.running.delay_ms));
  const session::MachineSight sight{video::now() - from_seconds(view_age_s), view.simulated_s, view.truth.joint_rad,
                                    view.truth.events};
  for (const auto& camera : simulated_cameras_) camera->show(sight, delay);
  bell_->quiet();
  const std::optional<Time> came = cameras_.watch(video::now(), view, view_age_s, events);
  if (came) note_picture(*came);
  sound(view, events, view_age_s);
  const Standing stands{view.machine.mode, view.machine.limits, view.machine.contact,
                        screens::measured_freshness(view).after(view_age_s).stale(), events.open(Severity::kAlarm)};
  const bool same = std::exchange(drawn_stands_, stands) == stands;
  if (came && same && window_.slow() && !window_.touched() && draw_picture_only()) return;
  window_.begin_frame();
  take_keys();
  state_.pad = {};  // held as long as it is drawn
  if (std::exchange(align_asked_, false)) align_camera(view, events);
  if (live_jump_) live_plots_.jump(*live_jump_ == KeyAction::kEventOn, events, view);
  live_jump_.reset();
  live_plots_.update(view);
  draw(view, loop, events, view_age_s);
}

void ConsoleWindow::note_picture(Time received) {
  constexpr Duration kLongest = 100ms;
  picture_period_ = picture_at_ == kNever ? Duration{} : std::clamp(received - picture_at_, Duration{}, kLongest);
  picture_at_ = received;
}

/// The new picture under what was drawn over the one before, if that holds: takes far less time than a whole frame.
bool ConsoleWindow::draw_picture_only() {
  const screens::CameraPane::Placed* camera = cameras_.drawn_large();
  if (camera == nullptr || !layered_) return false;
  over_picture_.draw_over(*camera->video, true);
  return true;
}

void ConsoleWindow::show() {
  window_.swap();
  const Duration next = picture_at_ == kNever ? Duration{} : (picture_at_ + picture_period_).time_since_epoch();
  window_.wait(*bell_, std::chrono::steady_clock::time_point(next));
}

/// What came of it goes into a file that the machine's own can take in; from now on the picture is drawn over by it.
void ConsoleWindow::align_camera(const ConsoleView& view, EventBook& events) {
  if (!cameras_.aligning() && !cameras_.large())
    return events.add(view.now, view.run, Severity::kInfo, "camera",
                      "nothing to align: no camera fills the pane (X makes another picture large)");
  const std::optional<estimation::CameraFit> fit = cameras_.align(facts_.machine);
  if (!fit) return;
  const std::string camera = "camera " + fit->camera.name + ": ";
  const auto tell = [&](Severity severity, const std::string& what) {
    events.add(view.now, view.run, severity, "camera", camera + what);
  };
  if (!fit->refused.empty()) return tell(Severity::kWarning, "not aligned: " + fit->refused);
  auto& all = facts_.machine.cameras;
  std::erase_if(all, [&fit](const CameraDescription& c) { return c.name == fit->camera.name; });
  all.push_back(fit->camera);
  const std::string path = "camera_" + fit->camera.name + ".toml";
  try {
    cli::OutputFile file("camera", path);
    file.stream() << estimation::camera_block(*fit);
    const std::string kept = file.commit_keeping_older();
    tell(Severity::kInfo, fmt::format("aligned, residual {:.1f} px; the block for the machine's file is in {}{}",
                                      fit->rms_px, path, kept.empty() ? "" : ", the one before in " + kept));
  } catch (const InputError& error) {
    tell(Severity::kWarning, std::string("aligned, but not written: ") + error.what());
  }
}

void ConsoleWindow::make_sounds(bool muted) {
  state_.muted = muted;
  sounds_ = std::make_unique<video::SoundPlayer>();
}

void ConsoleWindow::sound(const ConsoleView& view, EventBook& events, double view_age_s) {
  const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  const Freshness fresh = screens::machine_freshness(view).after(view_age_s);
  const AlarmSound due = alarms_.step(view, fresh.heard && fresh.stale(), events.open(Severity::kAlarm) == 0, now_s);
  if (!sounds_) return;
  if (const std::string problem = sounds_->problem(); problem != std::exchange(state_.sound_problem, problem)) {
    events.add(view.now, view.run, problem.empty() ? Severity::kInfo : Severity::kWarning, "sound",
               problem.empty() ? "alarm sounds can be heard again" : "no alarm sound can be heard: " + problem);
  }
  if (due != AlarmSound::kNone && !state_.muted) sounds_->play(samples_of(due, video::SoundPlayer::kRate_Hz));
}

void ConsoleWindow::frame_of_player() {
  window_.begin_frame();
  take_keys();
  player_->pass(0);  // as far as keys have moved it
  machine_.watch(player_->view());
  draw(player_->view(), {}, player_->events(), 0);
}

/// A window that has no room for any screen: one sentence, nobody leads, and Stop is a key or a click anywhere.
void ConsoleWindow::draw_too_small(const ConsoleView& view) {
  const Theme& t = window_.theme();
  screens::open_canvas();
  const bool live = player_ == nullptr;
  if (live && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) state_.stop = true;
  const Area all = Area{{0, 0}, ImGui::GetIO().DisplaySize}.inset(t.px(6));
  std::string text = fmt::format("This window is too small: {} x {} are needed", kLeastWidth, kLeastHeight);
  if (live)
    text = state_.stop ? "Stop is pressed. " + text : text + ". Enable counts as let go; Stop: Space or a click";
  const ImFont* font = t.fonts.body;
  const float height = text_height(font, all.width(), text);
  put_lines(font, t.colours.text, all.inset(0, std::max(0.F, all.height() - height) / 2), text);
  focus_.end_frame();
  machine_.take_mouse({}, state_.side_view, view);
  ImGui::End();
  layered_ = false;
  machine_picture_.reset();
  window_.clear();
  window_.draw_widgets();
}

void ConsoleWindow::draw(const ConsoleView& view, const LoopHealth& loop, EventBook& events, double view_age_s) {
  if (window_.too_small()) return draw_too_small(view);
  const PlanarVector tip_m = kinematics_.tip(view.machine.position_rad);
  if (screens::measured_freshness(view).after(view_age_s).stale())
    state_.measures.drop();
  else
    state_.measures.take_tip(tip_m);
  if (state_.screen == Screen::kOperate && zoom_ != 0) machine_.zoom(state_.side_view, zoom_, tip_m);
  zoom_ = 0;
  const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  const Ui ui{window_.theme(), focus_, {state_.units}, now_s, view_age_s, steady_, player_ != nullptr};
  const JointLoads loads = screens::measured_freshness(view).after(view_age_s).stale() ? JointLoads{}
                           : player_ != nullptr                                        ? player_->loads()
                                                                                       : loads_;
  screens::open_canvas();
  const std::optional<Area> picture = screens::draw_console(
      ui,
      {facts_, kinematics_, view, loads, loop, player_ != nullptr ? player_->plots() : live_plots_.window(),
       live_plots_, player_ != nullptr ? player_->kept() : kept_, machine_, events, cameras_, recording_, player_},
      state_);
  machine_picture_ = picture;
  // The tip of a machine that was recorded cannot be pulled.
  const bool no_mouse = !picture || (player_ != nullptr && state_.side_view);
  focus_.end_frame();
  machine_.take_mouse(no_mouse ? Area{} : *picture, state_.side_view, view);
  // A pull that began otherwise enables nothing, whatever is switched while it lasts.
  if (!machine_.pulled().presence) pointer_may_enable_ = state_.hold_to_run && state_.side_view;
  pointer_may_enable_ = pointer_may_enable_ && state_.hold_to_run;
  state_.pull_ignored = state_.hold_to_run && state_.side_view &&
                        (machine_.pull_ended() || (machine_.pulled().presence && !pointer_may_enable_));
  ImGui::End();
  const std::optional<screens::CameraPane::Placed>& camera = cameras_.placed();
  const auto [width, height] = window_.framebuffer_size();
  const bool over = picture && camera && camera->large && camera->video != nullptr &&
                    over_picture_.begin(width, height, picture::viewport_of(camera->picture));
  layered_ = over;
  window_.clear();
  const bool stale = ui.loop_silent() || screens::measured_freshness(view).after(view_age_s).stale();
  if (picture)
    draw_pictures(*picture, screens::shown_grid(ui.units, state_, machine_.camera(state_.side_view), *picture), stale,
                  view);
  window_.draw_widgets();
  if (over) {
    over_picture_.end();
    over_picture_.draw_over(*camera->video, camera->live);
  }
  cameras_.draw_done();
}

/// The machine's, and a camera's: the small one last.
void ConsoleWindow::draw_pictures(const Area& machine, const std::optional<picture::Grid>& grid, bool stale,
                                  const ConsoleView& view) {
  const std::optional<screens::CameraPane::Placed>& camera = cameras_.placed();
  const auto draw_camera = [&] {
    if (camera->video != nullptr) camera->video->draw(picture::viewport_of(camera->picture), camera->live);
  };
  if (camera && camera->large) {
    if (layered_)
      over_picture_.cut_hole();
    else
      draw_camera();
    // A mark is only drawn where both the picture and what was measured are of now.
    const CameraDescription* mount = find_camera(facts_.machine, *camera->name);
    if (mount != nullptr && camera->live && !stale) machine_.draw_over(camera->picture, *mount, state_.light, view);
  }
  machine_.draw(machine, state_.side_view, state_.light, stale, view, grid,
                player_ != nullptr ? player_->beside_view() : nullptr);
  if (camera && !camera->large) draw_camera();
}

void ConsoleWindow::take_gamepad(const std::optional<GamepadState>& state) {
  gamepad_ = {};
  state_.pad_ignored = false;
  if (!state) {
    pad_enable_was_up_ = false;
    pad_came_back_ = true;
    return;
  }
  const GamepadHand read = hand_from_gamepad(*state);
  // A gamepad that was reconnected reports every button as up, until it reports what is held.
  if (read.hand.enable) pad_came_back_ = false;
  pad_enable_was_up_ |= !read.hand.enable && !pad_came_back_;
  gamepad_ = read.hand;
  gamepad_.enable = read.hand.enable && pad_enable_was_up_;
  state_.pad_ignored = read.hand.enable && !pad_enable_was_up_;
  if (read.stop) state_.stop = true;
}

void ConsoleWindow::take_keys() {
  const bool enable = window_.key_down(GLFW_KEY_LEFT_SHIFT) || window_.key_down(GLFW_KEY_RIGHT_SHIFT);
  state_.typing = ImGui::GetIO().WantTextInput;
  const bool height = std::exchange(state_.measures.typed, false);
  state_.typing_number = state_.typing && height;
  keys_enable_was_up_ = !state_.typing && (keys_enable_was_up_ || !enable);
  state_.enable_ignored = enable && !keys_enable_was_up_;
  for (const KeyPress& press : window_.key_presses()) {
    const bool control = (press.modifiers & kControl) != 0;
    const auto asked_for = [&](const KeyBinding& b) {
      return b.held == nullptr && b.key == press.key && (b.control == control || b.action == KeyAction::kStop);
    };
    const bool typing = ImGui::GetIO().WantTextInput;
    if (player_ != nullptr) {
      const auto own = std::find_if(kPlayerKeys.begin(), kPlayerKeys.end(), asked_for);
      if (own != kPlayerKeys.end() && !typing) act_on_player(own->action);
      if (own != kPlayerKeys.end()) continue;
    }
    const auto binding = std::find_if(kKeys.begin(), kKeys.end(), asked_for);
    if (binding == kKeys.end() || (player_ != nullptr && !acts_on_window(*binding))) continue;
    if (typing && !acts_in_text(*binding, state_.typing_number)) continue;
    act(*binding);
  }
}

void ConsoleWindow::act_on_player(KeyAction action) {
  player::Timeline& timeline = player_->timeline();
  switch (action) {
    case KeyAction::kPlay:
      return timeline.toggle();
    case KeyAction::kStepBack:
    case KeyAction::kStepOn:
      return timeline.step(action == KeyAction::kStepOn);
    case KeyAction::kSecondBack:
      return timeline.move(-1s);
    case KeyAction::kSecondOn:
      return timeline.move(1s);
    case KeyAction::kEventBack:
    case KeyAction::kEventOn:
      return timeline.jump(action == KeyAction::kEventOn);
    case KeyAction::kSlower:
      return timeline.slower();
    case KeyAction::kFaster:
      return timeline.faster();
    case KeyAction::kBegin:
      return timeline.seek(player_->played().run.first());
    case KeyAction::kEnd:
      return timeline.seek(player_->played().run.last());
    default:
      return;
  }
}

void ConsoleWindow::act(const KeyBinding& binding) {
  const KeyAction action = binding.action;
  switch (action) {
    case KeyAction::kStop:
      state_.stop = true;
      return;
    case KeyAction::kReleaseStop:
      state_.stop = false;
      return;
    case KeyAction::kScreen:
      state_.screen = screen_of(binding);
      state_.help = false;
      return;
    case KeyAction::kPause:
      state_.paused = !state_.paused;
      return;
    case KeyAction::kReset:
      ++state_.reset_count;
      return;
    case KeyAction::kBookmark:
      ++state_.bookmarks;
      return;
    case KeyAction::kHoldToRun:
      state_.hold_to_run = !state_.hold_to_run;
      return;
    case KeyAction::kMute:
      state_.muted = !state_.muted;
      return;
    case KeyAction::kGround:
      state_.measures.take = screens::Measures::Take::kGround;
      return;
    case KeyAction::kGradePoint:
      state_.measures.take = screens::Measures::Take::kGradePoint;
      return;
    case KeyAction::kGradeSlope:
      state_.measures.take = screens::Measures::Take::kGradeSlope;
      return;
    case KeyAction::kCloser:
      zoom_ += kZoomSteps;
      return;
    case KeyAction::kFarther:
      zoom_ -= kZoomSteps;
      return;
    case KeyAction::kWhole:
      return machine_.show_whole();
    case KeyAction::kView:
      state_.side_view = !state_.side_view;
      return;
    case KeyAction::kPicture:
      return cameras_.next();
    case KeyAction::kAlign:
      align_asked_ = state_.screen == Screen::kOperate;
      return;
    case KeyAction::kTheme:
      state_.light = !state_.light;
      return window_.set_light(state_.light);
    case KeyAction::kUnits:
      state_.units = state_.units == UnitSystem::kMetric ? UnitSystem::kImperial : UnitSystem::kMetric;
      return;
    case KeyAction::kFullScreen:
      return window_.toggle_full_screen();
    case KeyAction::kLarger:
      return window_.change_scale(kScaleStep);
    case KeyAction::kSmaller:
      return window_.change_scale(1 / kScaleStep);
    case KeyAction::kFocusOn:
      return focus_.ask(FocusOrder::Move::kOn);
    case KeyAction::kFocusBack:
      return focus_.ask(FocusOrder::Move::kBack);
    case KeyAction::kHelp:
      state_.help = !state_.help;
      return;
    case KeyAction::kEventBack:
    case KeyAction::kEventOn:
      live_jump_ = action;
      return;
    case KeyAction::kEnd:
      return live_plots_.choose(std::nullopt);
    default:
      return;  // held, or the player's
  }
}

HeldKeys ConsoleWindow::held_keys() const {
  HeldKeys held;
  if (ImGui::GetIO().WantTextInput) return held;
  for (const KeyBinding& b : kKeys)
    if (b.held != nullptr && window_.key_down(b.key)) held.*b.held = true;
  held.enable = held.enable && keys_enable_was_up_;
  return held;
}

ConsoleInput ConsoleWindow::input(Time now) const {
  ConsoleInput input;
  if (player_ != nullptr) return input;
  input.at = now;
  input.attended = window_.attended();
  input.too_small = window_.too_small();
  HandInput pulled = machine_.pulled();
  pulled.enable = pointer_may_enable_ && pulled.presence;
  input.hand = together(together(hand_from_keys(held_keys()), hand_from_keys(state_.pad)), together(pulled, gamepad_));
  input.stop = state_.stop;
  input.home = state_.home;
  if (state_.scales_chosen) {
    input.position_scale = static_cast<double>(state_.position_scale);
    input.force_scale = 1 / static_cast<double>(state_.force_scale);
  }
  input.assist = state_.assist;
  input.force_most_N = static_cast<double>(state_.force_most_N);
  input.paused = state_.paused;
  input.reset_count = state_.reset_count;
  return input;
}

}  // namespace knuckle::console::window
