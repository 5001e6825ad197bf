#include "app/bringup/commission_wizard.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/bringup/commission_result.h"
#include "core/units.h"
#include "slave/safety_gate.h"

namespace knuckle::bringup {
namespace {

using Level = Finding::Level;

constexpr double kSmallWay_m = 0.015, kRampWay_m = 0.005;
constexpr double kRampRise_1ps = 0.03;
constexpr double kEndOpening = 0.14;  // behind the dead band
constexpr double kSmallest_s = 10, kStroke_s = 80;
constexpr double kPresetError_m = 1e-3;
constexpr double kTape_mm = 10, kTape_m = 1e-3 * kTape_mm;  // a drawing that is off
constexpr Duration kEStopPatience = 2s;

class Wizard {
 public:
  Wizard(const MachineDescription& machine, BusAccess& access, Partner partner, const std::function<void()>& check,
         const Resume& resume)
      : file_(machine),
        machine_(with_zeros(machine, resume.from.axes)),
        access_(access),
        check_(check),
        resume_(resume),
        dialogue_(std::move(partner), [this] { idle(); }) {
    progress_.serials.clear();
    result_.axes = resume.from.axes;
  }

  void prepare() {
    dialogue_.say("While something moves, " + dialogue_.stop_gesture() +
                  " ends the commissioning with the machine neutral.");
    dialogue_.ask(
        "Tracks blocked, bucket free of ground and load, engine at low speed, no person in reach, a hand on the "
        "machine's own E-stop?",
        {"ready"});
  }

  /// Reads only.
  void identity() {
    dialogue_.begin(1, "Identity");
    result_.nodes = sound_bus(machine_, access_, dialogue_, check_).nodes;
    for (const NodeLine& node : result_.nodes)
      if (node.serial && machine_.bus.find(node.id) != nullptr) progress_.serials[node.id] = *node.serial;
    check_serials();
  }

  void probe() {
    dialogue_.begin(2, "Nodes");
    if (machine_.bus.without_nodes())
      dialogue_.ask("Now command frames are sent, all at neutral. Nothing may move.", {"send"});
    else
      dialogue_.ask("Now the nodes are configured and started; pilot pressure stays off.", {"configure"});
    alone_on_bus(machine_, access_);
    start_bench();
    tell_emergencies();
    show_readings();
    e_stop();
    tilt();
    check_presets();
    // Before its zero is known, an angle says no length, and steps 3 to 6 are judged by lengths.
    for (int j = 0; j < kJoints; ++j)
      if (machine_.bus.measures_angle(j) && !axis_of(j).preset) zero(j, std::nullopt, std::nullopt);
  }

  void enable_motion() {
    dialogue_.begin(3, "Motion enable");
    if (machine_.bus.by_frames()) {
      dialogue_.ask(
          "Step 1 of 2: for two seconds the machine is told that it is led, with all joints at neutral. No cylinder "
          "may "
          "move.",
          {"pilot"});
      bench_->prove_closed();
      keep({Level::kOk, "neutral", "no cylinder moves"});
      dialogue_.ask("Step 2 of 2: from now on one cylinder at a time moves, each time after you confirm it.", {"move"});
      return;
    }
    dialogue_.ask("Step 1 of 3: pilot pressure on for two seconds with all valves closed. No cylinder may move.",
                  {"pilot"});
    bench_->prove_closed();
    keep({Level::kOk, "pilot pressure", "switches on and off, and no cylinder moves"});
    dialogue_.ask(
        "Step 2 of 3: what stops the machine without this computer. Each valve opens inside its dead band and gets no "
        "more set-points (no heartbeats where its guard waits for those); then the enable node gets no heartbeats. No "
        "cylinder may move.",
        {"guards"});
    trials().nodes(result_.guards);
    dialogue_.ask("Step 3 of 3: from now on one cylinder at a time moves, each time after you confirm it.", {"move"});
  }

  /// Makes it, unless the run that this one continues has completed it.
  void step(int number, void (Wizard::*make)()) {
    if (number <= resume_.from.completed) return dialogue_.say(fmt::format("\n{}. done before: skipped", number));
    const std::size_t before = result_.findings.size();
    (this->*make)();
    progress_.completed = number;
    progress_.axes = result_.axes;
    progress_.findings.insert(progress_.findings.end(), result_.findings.begin() + static_cast<std::ptrdiff_t>(before),
                              result_.findings.end());
    if (resume_.keep) resume_.keep(progress_);
  }

  void signs() {
    dialogue_.begin(4, "Signs: small motions");
    for (int j = 0; j < kJoints; ++j) {
      small_motion(j, 1);
      small_motion(j, -1);
    }
    if (!machine_.bus.by_frames()) return;
    dialogue_.ask(GuardTrials::motions_text(machine_.bus), {"guards"});
    trials().in_motion(result_.guards);
  }

  void strokes() {
    dialogue_.begin(5, "Stroke ends and zero");
    for (int j = 0; j < kJoints; ++j) {
      const auto extended = drive_to_end(j, 1), retracted = drive_to_end(j, -1);
      if (extended && retracted) {
        AxisResult& axis = axis_of(j);
        axis.stroke_m = extended->reading_m - retracted->reading_m;
        keep(judge_stroke(*axis.stroke_m, j, machine_));
      }
      if (offered(j, "moves back to the middle of its stroke", retracted || extended))
        (void)lead(j, retracted ? 1 : -1, stroke_m(j) / 2, false);
      if (!machine_.bus.measures_angle(j)) zero(j, extended, retracted);
    }
  }

  void dead_bands() {
    dialogue_.begin(6, "Dead bands");
    if (by_rate())
      return keep({Level::kNote, "dead bands", "not measured: the machine's own controller keeps the speed"});
    for (int j = 0; j < kJoints; ++j) {
      if (!offered(j, "slow ramps in both directions", true)) continue;
      AxisResult& axis = axis_of(j);
      axis.dead_band_extend = ramp(j, 1);
      axis.dead_band_retract = ramp(j, -1);
    }
  }

  template <typename Record>
  void hand_over(const Record& record) {
    dialogue_.begin(7, "Identification");
    bool zeroed = true;
    for (const AxisResult& axis : result_.axes) zeroed = zeroed && axis.preset;
    if (!zeroed) {
      dialogue_.ask("Nothing is recorded: closed loop needs the preset of all three encoders.", {"finish"});
      return;
    }
    if (dialogue_.ask(
            "Motion of all joints over their whole ranges, in closed loop, recorded for 'knuckle identify'. The "
            "whole range must be free of obstacles; " +
                dialogue_.stop_gesture() + " stops the motion.",
            {"record", "finish"}) == 1) {
      return;
    }
    bench_->neutral();
    result_.recordings = record(found_machine(file_, result_.axes), [this] {
      check_();
      return dialogue_.interrupted();
    });
  }

  /// Whatever happened before. Nodes that were not configured, or are somebody else's, are left as they are.
  void out_of_service() noexcept {
    if (!bench_ || !bench_->client().commanded()) return;
    dialogue_.say('\n' + take_out_of_service(machine_, access_, bench_->may_command()));
  }
  [[nodiscard]] WizardResult take() {
    const Findings& before = resume_.from.findings;
    result_.findings.insert(result_.findings.end(), before.begin(), before.end());
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool by_rate() const { return machine_.bus.command_kind == CommandKind::kJointRate; }

  void start_bench() {
    bench_.emplace(machine_, access_, [this] {
      check_();
      return dialogue_.interrupted();
    });
    bench_->start();
    bench_->idle(500ms);
  }

  [[nodiscard]] GuardTrials trials() { return {machine_.bus, *bench_, progress_.serials, keep_}; }

  /// Told since the last call. A node that tells an error while it works ends the commissioning by itself.
  void tell_emergencies() {
    for (const std::string& text : bench_->emergencies()) keep({Level::kNote, "emergency", text});
  }

  void idle() {
    check_();
    if (bench_)
      bench_->idle();
    else
      access_.wait_until(access_.now() + 5ms);
  }

  /// Reports it at once; a fault ends the commissioning, as the next steps depend on it.
  void keep(const Finding& finding) {
    result_.findings.push_back(finding);
    dialogue_.say(fmt::format("   {}  ", name(finding.level)) + finding.about + ": " + finding.text);
    if (finding.level == Level::kFault) throw CommissionEnded(finding.about + ": " + finding.text);
  }

  /// @return false where it was skipped.
  bool offered(int joint, const std::string& what, bool possible) {
    if (!possible) return false;
    return dialogue_.ask(std::string(axis_name(joint)) + ": " + what, {"go", "skip"}) == 0;
  }

  void show_readings() {
    const slave::RawSensors& s = bench_->sensors();
    for (std::size_t j = 0; j < kJoints; ++j) {
      const std::string length = s.no_length[j] ? "no length" : fmt::format("{:.4f} m", length_m(static_cast<int>(j)));
      const std::string pressures = static_cast<int>(j) == machine_.sensors.without_pressures
                                        ? "pressures not measured"
                                        : fmt::format("head side {:.1f} bar, rod side {:.1f} bar",
                                                      s.pressure_Pa[2 * j] / 1e5, s.pressure_Pa[2 * j + 1] / 1e5);
      dialogue_.say(fmt::format("   {:6} {}, {}, spool {:+.1f} %", kJointNames[j], length, pressures,
                                100 * bench_->client().spool()[static_cast<int>(j)]));
    }
    dialogue_.say(fmt::format("   tilt {:.2f} deg", s.tilt_rad / kDegree));
    bench_->check_values();
  }

  void e_stop() {
    if (!bench_->tells_e_stop())
      return keep({Level::kNote, "E-stop",
                   "no frame tells of it: press it with the engine running, and see that the levers do nothing"});
    const std::string who = machine_.bus.has_enable() ? "the enable node" : "the machine";
    const auto wait_for = [&](bool open) {
      for (const Time end = access_.now() + kEStopPatience; bench_->e_stop_open() != open; bench_->idle()) {
        if (access_.now() >= end)
          throw CommissionEnded(
              open ? "the E-stop was pressed, but " + who + " reports its chain closed: check the input"
                   : "the E-stop was released, but " + who + " reports its chain open: check the chain");
      }
    };
    dialogue_.ask("Press the machine's E-stop.", {"pressed"});
    access_.press_e_stop(true);
    wait_for(true);
    dialogue_.ask("Release the E-stop.", {"released"});
    access_.press_e_stop(false);
    wait_for(false);
    keep({Level::kOk, "E-stop", "pressed and released, as reported by " + who});
  }

  void tilt() {
    if (machine_.sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom) {
      keep({Level::kNote, "tilt", "on the boom: not compared here; knuckle identify checks it"});
      return;
    }
    const double level_rad =
        kDegree * dialogue_.ask_number("The hull's slope by a spirit level, front up positive", -30, 30, "degrees");
    const double reading_rad = bench_->sensors().tilt_rad;
    result_.tilt_error_rad = reading_rad - level_rad;
    keep(judge_tilt(reading_rad, level_rad));
  }

  [[nodiscard]] AxisResult& axis_of(int joint) { return result_.axes[static_cast<std::size_t>(joint)]; }
  [[nodiscard]] const CylinderDescription& cylinder(int joint) const {
    return machine_.cylinders[static_cast<std::size_t>(joint)];
  }
  [[nodiscard]] double stroke_m(int joint) const { return cylinder(joint).max_length_m - cylinder(joint).min_length_m; }
  [[nodiscard]] double file_dead_band(int joint, int direction) const {
    return by_rate() ? 0 : cylinder(joint).valve.dead_band(direction > 0);
  }
  /// Some centimetres a second.
  [[nodiscard]] JogRun lead(int joint, int direction, double travel_m, bool until_stall) {
    const double peak = std::min(file_dead_band(joint, direction) + kEndOpening, slave::kJogTable.command);
    return bench_->run({.joint = joint,
                        .peak = direction * peak,
                        .rise_1ps = 0.1,
                        .travel_m = travel_m,
                        .longest_s = kStroke_s,
                        .until_stall = until_stall});
  }

  void small_motion(int joint, int direction) {
    const char* verb = direction > 0 ? "extends" : "retracts";
    dialogue_.ask(fmt::format("Some seconds after your answer the {} cylinder {} slowly by about {:.0f} mm: watch it.",
                              axis_name(joint), verb, 1e3 * kSmallWay_m),
                  {"go"});
    const JogRun run = bench_->run({.joint = joint,
                                    .peak = direction * slave::kJogTable.command,
                                    .travel_m = kSmallWay_m,
                                    .longest_s = kSmallest_s});
    const int seen = dialogue_.ask("What did that cylinder do? (another: another cylinder moved)",
                                   {"longer", "shorter", "still", "another"});
    keep(judge_direction(run, static_cast<Seen>(seen), machine_.bus));
  }

  std::optional<StrokeEnd> drive_to_end(int joint, int direction) {
    if (!offered(joint, direction > 0 ? "extends to its stop" : "retracts to its stop", true)) return std::nullopt;
    const JogRun run = lead(joint, direction, 1.1 * stroke_m(joint) + 0.02, true);
    const auto end = stroke_end(run);
    const std::string about = axis_name(joint);
    if (run.end == slave::JogEnd::kTravelled) {
      keep({Level::kFault, about,
            fmt::format("moved by {:.1f} mm, the machine file has a stroke of {:.1f} mm: check {}, min_length_m and "
                        "max_length_m",
                        1e3 * std::abs(run.travelled_m()[joint]), 1e3 * stroke_m(joint), step_key(machine_, joint))});
    }
    if (!end)
      keep({Level::kFault, about, "did not reach its stop within 80 s: check pump, engine speed and dead band"});
    dialogue_.say(fmt::format("   {} at its stop: {:.4f} m", about, end->reading_m));
    if (joint == machine_.sensors.without_pressures)
      keep({Level::kNote, about, "sides not checked: nobody measures its pressures"});
    else
      keep(judge_sides(*end, joint, direction > 0));
    return end;
  }

  /// By its encoder; NaN where the angle of a rotary one is none of the joint's.
  [[nodiscard]] double length_m(int joint) const {
    const slave::RawSensors& s = bench_->sensors();
    return s.no_length[static_cast<std::size_t>(joint)] ? std::numeric_limits<double>::quiet_NaN() : s.length_m[joint];
  }
  [[nodiscard]] static std::string reading_text(double length_m) {
    return std::isnan(length_m) ? "no length" : fmt::format("{:.1f} mm", 1e3 * length_m);
  }

  /// @param extended, retracted readings at the stops, which lie within the cylinder's range whatever the zero is.
  void zero(int joint, const std::optional<StrokeEnd>& extended, const std::optional<StrokeEnd>& retracted) {
    AxisResult& axis = axis_of(joint);
    bench_->idle(500ms);
    const std::string about = axis_name(joint);
    const auto tape_m = access_.tape_m(joint);
    const double before_m = length_m(joint);
    const double way_in_m = retracted ? before_m - retracted->reading_m : 0;
    const double way_out_m = extended ? extended->reading_m - before_m : 0;
    const double tape_length_m =
        1e-3 * dialogue_.ask_number(about + ": the cylinder's length from pin to pin, measured with a tape",
                                    1e3 * (cylinder(joint).min_length_m + way_in_m) - kTape_mm,
                                    1e3 * (cylinder(joint).max_length_m - way_out_m) + kTape_mm, "mm",
                                    tape_m ? std::optional(1e3 * *tape_m) : std::nullopt);
    if (!std::isnan(before_m)) axis.offset_m = before_m - tape_length_m;
    if (machine_.bus.broadcast(NodeRole::kEncoder, joint).field != nullptr) return set_zero(joint, tape_length_m);
    const std::string question = fmt::format(
        "{}: the encoder reads {}, the tape {:.1f} mm. Preset the encoder (0x6003) to the tape's value and save it?",
        about, reading_text(before_m), 1e3 * tape_length_m);
    if (dialogue_.ask(question, {"preset", "keep"}) == 1) {
      if (std::isnan(before_m))
        keep({Level::kFault, about, "its encoder reads no length that its cylinder can have: it must be preset"});
      return;
    }
    preset(joint, tape_length_m);
    const double now_m = length_m(joint);
    axis.preset = std::abs(now_m - tape_length_m) <= kPresetError_m;
    if (!axis.preset) {
      keep({Level::kFault, about,
            fmt::format("reads {} after the preset to {:.1f} mm, tolerance {:.0f} mm: check the encoder by its manual",
                        reading_text(now_m), 1e3 * tape_length_m, 1e3 * kPresetError_m)});
    }
    keep({Level::kOk, about,
          fmt::format("encoder preset: {} before, {:.1f} mm now", reading_text(before_m), 1e3 * tape_length_m)});
  }

  void preset(int joint, double length_m) {
    bench_->write_objects(machine_.bus.encoder(joint).id, slave::preset_script(machine_, joint, length_m));
    bench_->idle(200ms);
  }

  /// Of an angle or a length that the machine sends by itself: nobody can preset it, but the file says what it means.
  void set_zero(int joint, double tape_m) {
    AxisResult& axis = axis_of(joint);
    const bool angle = machine_.bus.measures_angle(joint);
    const std::string about = axis_name(joint);
    const bool input = machine_.bus.broadcast(NodeRole::kEncoder, joint).field->analog.has_value();
    const char* const key = input ? "low and high" : angle ? "zero_rad" : "offset";
    const char* const source = input ? "module's input" : "machine's frame";
    const bool none = std::isnan(length_m(joint));
    if (dialogue_.ask(fmt::format("{}: the {} says {}, the tape {:.1f} mm. Correct {} in the machine file?", about,
                                  source, reading_text(length_m(joint)), 1e3 * tape_m, key),
                      {"correct", "keep"}) == 1) {
      if (none)
        keep({Level::kFault, about,
              std::string("the ") + source + " says no length that its cylinder can have: its zero must be corrected"});
      return;
    }
    axis.zero_shift =
        axis.zero_shift.value_or(0) + zero_shift(machine_, joint, bench_->sensors().encoder[joint], tape_m);
    machine_ = with_zeros(file_, result_.axes);
    start_bench();
    // A step of the value may make more of the length.
    axis.preset = std::abs(length_m(joint) - tape_m) <= kPresetError_m + length_steps_m(machine_)[joint];
    if (!axis.preset)
      keep({Level::kFault, about,
            fmt::format("says {} after its zero was corrected to {:.1f} mm: look whether its sensor stands still",
                        reading_text(length_m(joint)), 1e3 * tape_m)});
    keep({Level::kOk, about, fmt::format("{} corrected: {:.1f} mm now", key, 1e3 * length_m(joint))});
  }
  /// What the run before has found is of its nodes alone.
  void check_serials() const {
    for (const auto& [id, before] : resume_.from.serials) {
      const auto now = progress_.serials.find(id);
      if (now != progress_.serials.end() && now->second == before) continue;
      throw ProgressLost(
          fmt::format("node 0x{:02X}: serial number {}, in the run before {}: another device; begin "
                      "anew, without --resume",
                      id, now == progress_.serials.end() ? "none" : std::to_string(now->second), before));
    }
  }

  /// The run before has made encoders show their cylinder's length, and closed loop relies on it.
  void check_presets() {
    for (int joint = 0; joint < kJoints; ++joint) {
      if (!axis_of(joint).preset) continue;
      const std::string about = axis_name(joint);
      // A simulated machine is a new one in each run.
      const bool node = machine_.bus.broadcast(NodeRole::kEncoder, joint).field == nullptr;
      if (const auto tape_m = access_.tape_m(joint); tape_m && node) preset(joint, *tape_m);
      const double now_m = length_m(joint);
      const bool sound =
          now_m > cylinder(joint).min_length_m - kTape_m && now_m < cylinder(joint).max_length_m + kTape_m;
      const std::string reads = "encoder reads " + reading_text(now_m);
      if (!sound)
        throw ProgressLost(about + ": " + reads +
                           ", which its cylinder cannot have: the preset is lost; begin anew, without --resume");
      keep({Level::kOk, about, reads + ", preset by the run before"});
    }
  }

  std::optional<double> ramp(int joint, int direction) {
    const JogRun run = bench_->run({.joint = joint,
                                    .peak = direction * slave::kJogTable.command,
                                    .rise_1ps = kRampRise_1ps,
                                    .travel_m = kRampWay_m,
                                    .longest_s = slave::kJogTable.command / kRampRise_1ps + 1});
    const auto found = dead_band(run, cylinder(joint).valve);
    keep(judge_dead_band(found, file_dead_band(joint, direction), joint, direction));
    return found;
  }

  const MachineDescription& file_;
  MachineDescription machine_;  // with the zeros found so far
  BusAccess& access_;
  const std::function<void()>& check_;
  const Resume& resume_;
  WizardProgress progress_{resume_.from};
  Dialogue dialogue_;
  std::optional<JogBench> bench_;
  const std::function<void(const Finding&)> keep_ = [this](const Finding& finding) { keep(finding); };
  WizardResult result_;
};

}  // namespace

WizardResult run_wizard(
    const MachineDescription& machine, BusAccess& access, Partner partner,
    const std::function<std::vector<std::string>(const MachineDescription&, const std::function<bool()>&)>& record,
    const std::function<void()>& check, const Resume& resume) {
  Wizard wizard(machine, access, std::move(partner), check, resume);
  try {
    wizard.prepare();
    wizard.identity();
    wizard.probe();
    wizard.enable_motion();
    wizard.signs();
    wizard.step(kStrokes, &Wizard::strokes);
    wizard.step(kDeadBands, &Wizard::dead_bands);
    wizard.hand_over(record);
  } catch (...) {
    wizard.out_of_service();
    throw;
  }
  wizard.out_of_service();
  return wizard.take();
}

}  // namespace knuckle::bringup
