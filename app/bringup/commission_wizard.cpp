#include "app/bringup/commission_wizard.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "app/bringup/commission_result.h"
#include "app/bringup/doctor_report.h"
#include "app/bringup/orderly_stop.h"

namespace knuckle::bringup {
namespace {

using Level = Finding::Level;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kSmallWay_m = 0.015, kRampWay_m = 0.005;
constexpr double kRampRise_1ps = 0.03;
constexpr double kEndOpening = 0.14;  // behind the dead band: some centimetres a second
constexpr double kSmallest_s = 10, kStroke_s = 80;
constexpr double kCreep_m = 2e-3, kPresetError_m = 1e-3, kTiltError_rad = 1 * kDegree;
constexpr double kTape_mm = 10;  // a drawing that is off
constexpr Duration kEStopPatience = 2s;

template <typename... Values>
std::string put(const char* format, Values... values) {
  std::array<char, 240> line{};
  std::snprintf(line.data(), line.size(), format, values...);
  return line.data();
}

class Wizard {
 public:
  Wizard(const MachineDescription& machine, BusAccess& access, Partner partner, const std::function<void()>& check)
      : machine_(machine), access_(access), check_(check), dialogue_(std::move(partner), [this] { idle(); }) {}

  void prepare() {
    dialogue_.say("Any answer but the asked word, and " + dialogue_.stop_gesture() +
                  " while something moves, ends the commissioning with the machine neutral.");
    dialogue_.ask(
        "Tracks blocked, bucket free of ground and load, engine at low speed, nobody in reach, a hand on the "
        "machine's own E-stop?",
        {"ready"});
  }

  /// Reads only.
  void identity() {
    dialogue_.begin(1, "Identity");
    const BusSurvey survey = survey_bus(access_, machine_.bus.bit_rate, doctor_objects(machine_), {}, check_);
    const BusDiagnosis diagnosis = diagnose(survey, &machine_);
    for (const std::string& line : diagnosis_lines(diagnosis)) dialogue_.say(line);
    result_.nodes = diagnosis.nodes;
    if (!healthy(diagnosis.findings)) {
      throw CommissionEnded("the bus is not as it must be (see FAULT); nothing was configured or moved");
    }
  }

  void probe() {
    dialogue_.begin(2, "Nodes");
    dialogue_.ask("The nodes are configured and started now; pilot pressure stays off.", {"configure"});
    bench_.emplace(machine_, access_, [this] {
      check_();
      return dialogue_.interrupted();
    });
    bench_->start();
    bench_->idle(500ms);
    show_readings();
    e_stop();
    tilt();
  }

  void enable_motion() {
    dialogue_.begin(3, "Motion enable");
    dialogue_.ask("Step 1 of 2: pilot pressure on for two seconds, all valves closed. Nothing may move.", {"pilot"});
    const JointVector crept = bench_->try_pilot(2s);
    for (int j = 0; j < kJoints; ++j) {
      if (std::abs(crept[j]) <= kCreep_m) continue;
      throw CommissionEnded(
          put("the %s cylinder moved by %.1f mm with closed valves: check its spool's centring and "
              "its load holding valve",
              kJointNames[static_cast<std::size_t>(j)], 1e3 * crept[j]));
    }
    keep({Level::kOk, "pilot pressure", "comes, goes, and moves nothing by itself"});
    dialogue_.ask("Step 2 of 2: from here on one cylinder at a time moves, each motion after its word.", {"move"});
  }

  void signs() {
    dialogue_.begin(4, "Signs: small motions");
    for (int j = 0; j < kJoints; ++j) {
      small_motion(j, 1);
      small_motion(j, -1);
    }
  }

  void strokes() {
    dialogue_.begin(5, "Stroke ends and zero");
    for (int j = 0; j < kJoints; ++j) {
      const auto extended = drive_to_end(j, 1), retracted = drive_to_end(j, -1);
      if (extended && retracted) {
        AxisResult& axis = result_.axes[static_cast<std::size_t>(j)];
        axis.stroke_m = extended->reading_m - retracted->reading_m;
        keep(judge_stroke(*axis.stroke_m, j, machine_));
      }
      if (offered(j, "back to the middle of its stroke", retracted || extended)) to_middle(j, retracted.has_value());
      zero(j);
    }
  }

  void dead_bands() {
    dialogue_.begin(6, "Dead bands");
    for (int j = 0; j < kJoints; ++j) {
      if (!offered(j, "slow ramps both ways", true)) continue;
      AxisResult& axis = result_.axes[static_cast<std::size_t>(j)];
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
      dialogue_.say("Motion of all joints in closed loop needs all three encoders zeroed (preset).");
      dialogue_.ask("", {"finish"});
      return;
    }
    if (dialogue_.ask(
            "Motion of all joints over their whole ranges, in closed loop, recorded for 'knuckle identify'. The "
            "bucket needs room everywhere; " +
                dialogue_.stop_gesture() + " stops.",
            {"record", "finish"}) == 1) {
      return;
    }
    bench_->neutral();
    result_.recordings = record(found_machine(machine_, result_.axes), [this] {
      check_();
      return dialogue_.interrupted();
    });
  }

  /// Whatever happened before. Nodes that were left alone stay so.
  void out_of_service() noexcept {
    if (!bench_) return;
    OrderlyStop stop(machine_, access_.bus());
    while (!stop.done()) {
      stop.step(access_.now());
      access_.wait_until(access_.now() + from_seconds(1 / machine_.bus.sync_Hz));
    }
    const auto valves = stop.unconfirmed_valves();
    const bool confirmed = std::none_of(valves.begin(), valves.end(), [](bool open) { return open; });
    dialogue_.say(confirmed && !stop.unconfirmed_pilot()
                      ? "\nOut of service: valves disabled, pilot pressure off."
                      : "\nOut of service, but not all nodes said so: left to their own watchdogs.");
  }
  [[nodiscard]] WizardResult take() { return std::move(result_); }

 private:
  void idle() {
    check_();
    bench_ ? bench_->idle() : access_.wait_until(access_.now() + 5ms);
  }

  /// Says it at once; a fault ends the commissioning, as what follows would build on it.
  void keep(const Finding& finding) {
    result_.findings.push_back(finding);
    dialogue_.say(put("   %s  ", name(finding.level)) + finding.about + ": " + finding.text);
    if (finding.level == Level::kFault) throw CommissionEnded(finding.about + ": " + finding.text);
  }

  /// @return false where it was skipped.
  bool offered(int joint, const std::string& what, bool possible) {
    if (!possible) return false;
    return dialogue_.ask(std::string(kJointNames[static_cast<std::size_t>(joint)]) + ": " + what, {"go", "skip"}) == 0;
  }

  void show_readings() {
    const RawSensors& s = bench_->sensors();
    for (std::size_t j = 0; j < kJoints; ++j) {
      dialogue_.say(put("   %-6s %.4f m, head side %.1f bar, rod side %.1f bar, spool %+.1f %%", kJointNames[j],
                        s.length_m[static_cast<int>(j)], s.pressure_Pa[2 * j] / 1e5, s.pressure_Pa[2 * j + 1] / 1e5,
                        100 * bench_->client().spool()[static_cast<int>(j)]));
    }
    dialogue_.say(put("   tilt %.2f deg", s.tilt_rad / kDegree));
    if (s.invalid()) throw CommissionEnded("a pressure transmitter says that its value is invalid");
  }

  void e_stop() {
    const auto wait_for = [&](bool open) {
      for (const Time end = access_.now() + kEStopPatience; bench_->client().e_stop_open() != open; bench_->idle()) {
        if (access_.now() >= end) {
          throw CommissionEnded(
              open ? "the E-stop was pressed, but its chain shows closed: check the enable node's input"
                   : "the E-stop was released, but its chain shows open");
        }
      }
    };
    dialogue_.ask("Press the machine's E-stop.", {"pressed"});
    access_.press_e_stop(true);
    wait_for(true);
    dialogue_.ask("Release it.", {"released"});
    access_.press_e_stop(false);
    wait_for(false);
    keep({Level::kOk, "E-stop", "is seen both ways"});
  }

  void tilt() {
    if (machine_.sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom) {
      keep({Level::kNote, "tilt", "on the boom: not compared here; identification checks it"});
      return;
    }
    const double level_rad =
        kDegree * dialogue_.ask_number("The hull's slope by a spirit level, nose up positive, in degrees:", -30, 30);
    const double reading_rad = bench_->sensors().tilt_rad, error_rad = reading_rad - level_rad;
    result_.tilt_error_rad = error_rad;
    const bool off = std::abs(error_rad) > kTiltError_rad;
    const bool sign = off && std::abs(reading_rad + level_rad) <= kTiltError_rad;
    keep({off ? Level::kFault : Level::kOk, "tilt",
          put("shows %.2f deg, the spirit level %.2f deg", reading_rad / kDegree, level_rad / kDegree) +
              (sign  ? ": its sign is reversed; turn it round or set its direction"
               : off ? ": zero it by its manual, or mount it level"
                     : "")});
  }

  [[nodiscard]] double file_dead_band(int joint, int direction) const {
    const ValveDescription& valve = machine_.cylinders[static_cast<std::size_t>(joint)].valve;
    return direction > 0 ? valve.dead_band_extend : valve.dead_band_retract;
  }
  [[nodiscard]] const CylinderDescription& cylinder(int joint) const {
    return machine_.cylinders[static_cast<std::size_t>(joint)];
  }

  void small_motion(int joint, int direction) {
    const char* verb = direction > 0 ? "extends" : "retracts";
    dialogue_.ask(put("%s cylinder %s by about %.0f mm, slowly, after some seconds; watch it",
                      kJointNames[static_cast<std::size_t>(joint)], verb, 1e3 * kSmallWay_m),
                  {"go"});
    const JogRun run = bench_->run(
        {.joint = joint, .peak = direction * kJogLimits.command, .travel_m = kSmallWay_m, .longest_s = kSmallest_s});
    const int seen = dialogue_.ask("What did that cylinder do?", {"longer", "shorter", "still", "another"});
    keep(judge_direction(run, static_cast<Seen>(seen)));
  }

  std::optional<StrokeEnd> drive_to_end(int joint, int direction) {
    if (!offered(joint, direction > 0 ? "extends to its stop" : "retracts to its stop", true)) return std::nullopt;
    const double stroke_m = cylinder(joint).max_length_m - cylinder(joint).min_length_m;
    const double peak = std::min(file_dead_band(joint, direction) + kEndOpening, kJogLimits.command);
    const JogRun run = bench_->run({.joint = joint,
                                    .peak = direction * peak,
                                    .rise_1ps = 0.1,
                                    .travel_m = 1.1 * stroke_m + 0.02,
                                    .longest_s = kStroke_s,
                                    .until_stall = true});
    const auto end = stroke_end(run);
    const std::string about = kJointNames[static_cast<std::size_t>(joint)];
    if (run.end == JogRun::End::kTravelled) {
      keep({Level::kFault, about, "goes further than the file's stroke: check encoder_step_mm and the stroke"});
    }
    if (!end) keep({Level::kFault, about, "did not reach its stop in time: check pump, engine speed and dead band"});
    dialogue_.say(put("   %s stop at %.4f m", about.c_str(), end->reading_m));
    keep(judge_sides(*end, joint, direction > 0));
    return end;
  }

  void zero(int joint) {
    AxisResult& axis = result_.axes[static_cast<std::size_t>(joint)];
    bench_->idle(500ms);
    const std::string about = kJointNames[static_cast<std::size_t>(joint)];
    const auto tape_m = access_.tape_m(joint);
    const double length_m =
        1e-3 * dialogue_.ask_number(about + ": the cylinder's length from pin to pin by a tape, in mm:",
                                    1e3 * cylinder(joint).min_length_m - kTape_mm,
                                    1e3 * cylinder(joint).max_length_m + kTape_mm,
                                    tape_m ? std::optional(1e3 * *tape_m) : std::nullopt);
    axis.offset_m = bench_->sensors().length_m[joint] - length_m;
    const std::string question = put("%s: the encoder shows %+.1f mm more. Preset it (0x6003) to %.1f mm and save?",
                                     about.c_str(), 1e3 * *axis.offset_m, 1e3 * length_m);
    if (dialogue_.ask(question, {"preset", "keep"}) == 1) return;
    const double before_m = bench_->sensors().length_m[joint];
    bench_->tell(machine_.bus.encoders[static_cast<std::size_t>(joint)].id, slave::preset_script(machine_, length_m));
    bench_->idle(200ms);
    const double error_m = bench_->sensors().length_m[joint] - length_m;
    axis.preset = std::abs(error_m) <= kPresetError_m;
    if (!axis.preset) {
      keep({Level::kFault, about,
            put("took the preset, but shows %.1f mm instead of %.1f mm", 1e3 * (length_m + error_m), 1e3 * length_m)});
    }
    keep({Level::kOk, about, put("encoder preset: %.1f mm before, %.1f mm now", 1e3 * before_m, 1e3 * length_m)});
  }

  void to_middle(int joint, bool from_retracted) {
    const int direction = from_retracted ? 1 : -1;
    const double stroke_m = cylinder(joint).max_length_m - cylinder(joint).min_length_m;
    const double peak = std::min(file_dead_band(joint, direction) + kEndOpening, kJogLimits.command);
    (void)bench_->run(
        {.joint = joint, .peak = direction * peak, .rise_1ps = 0.1, .travel_m = stroke_m / 2, .longest_s = kStroke_s});
  }

  std::optional<double> ramp(int joint, int direction) {
    const JogRun run = bench_->run({.joint = joint,
                                    .peak = direction * kJogLimits.command,
                                    .rise_1ps = kRampRise_1ps,
                                    .travel_m = kRampWay_m,
                                    .longest_s = kJogLimits.command / kRampRise_1ps + 1});
    const auto found = dead_band(run, cylinder(joint).valve);
    const std::string about = kJointNames[static_cast<std::size_t>(joint)];
    const char* way = direction > 0 ? "extend" : "retract";
    if (!found) {
      keep({Level::kNote, about, put("dead band to %s not found: the ramp did not move it evenly", way)});
      return std::nullopt;
    }
    const double file = file_dead_band(joint, direction);
    const bool off = dead_band_differs(*found, file);
    keep({off ? Level::kNote : Level::kOk, about,
          put("dead band to %s %.1f %% of stroke, the file says %.1f %%", way, 100 * *found, 100 * file) +
              (off ? put("; the result has it as dead_band_%s", way) : std::string())});
    return found;
  }

  const MachineDescription& machine_;
  BusAccess& access_;
  const std::function<void()>& check_;
  Dialogue dialogue_;
  std::optional<JogBench> bench_;
  WizardResult result_;
};

}  // namespace

WizardResult run_wizard(
    const MachineDescription& machine, BusAccess& access, Partner partner,
    const std::function<std::vector<std::string>(const MachineDescription&, const std::function<bool()>&)>& record,
    const std::function<void()>& check) {
  Wizard wizard(machine, access, std::move(partner), check);
  try {
    wizard.prepare();
    wizard.identity();
    wizard.probe();
    wizard.enable_motion();
    wizard.signs();
    wizard.strokes();
    wizard.dead_bands();
    wizard.hand_over(record);
  } catch (...) {
    wizard.out_of_service();
    throw;
  }
  wizard.out_of_service();
  return wizard.take();
}

}  // namespace knuckle::bringup
