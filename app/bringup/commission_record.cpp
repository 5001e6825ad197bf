#include "app/bringup/commission_record.h"

#include <algorithm>

#include "app/bringup/commission_dialogue.h"
#include "app/cli/output_file.h"
#include "app/motion/transfer.h"
#include "app/recordings/recording_reader.h"
#include "core/loop_table.h"
#include "estimation/identification/excitation.h"

namespace knuckle::bringup {
namespace {

constexpr Duration kComeUp = 15s, kRestart = 3s, kSettle = 20s, kStand = 500ms, kRest = 1500ms;
constexpr Duration kRelease = 300ms;

}  // namespace

LedMachine::LedMachine(const MachineDescription& machine, BusAccess& access, std::function<bool()> stopped)
    : machine_(machine),
      kinematics_(machine),
      access_(access),
      stopped_(std::move(stopped)),
      period_(from_seconds(1 / machine.bus.sync_Hz)),
      step_due_(access.now()),
      link_({}, {}, 1),
      leader_(link_.a()),
      slave_(machine, access.bus(), link_.b()) {}

/// A period that was missed is skipped.
bool LedMachine::advance() {
  access_.wait_until(access_.now() + kTick);
  const Time now = access_.now();
  link_.advance(now);
  leader_.step(now);
  if (now < step_due_) return false;
  step_due_ = std::max(step_due_ + period_, now);
  slave_.step(now);
  return true;
}

void LedMachine::tick() {
  const JointVector demand = slave_.client().demand();  // on the wire while these sensors were sampled
  if (advance()) {
    sample(demand);
    if (stopped_()) throw CommissionEnded("stopped from the keyboard");
  }
  if (!leader_.dropped_out()) return;
  recording_ = nullptr;
  throw CommissionEnded("the machine is no longer engaged: " + text(leader_.trouble()));
}

template <typename Condition>
void LedMachine::run_until(Condition reached, Duration patience, const char* what) {
  for (const Time end = access_.now() + patience; !reached(); tick()) {
    if (access_.now() < end) continue;
    const std::string details = text(slave_.client().setup_failure());
    throw CommissionEnded(what + (details.empty() ? ": " + text(leader_.trouble()) : ": " + details));
  }
}

void LedMachine::engage() {
  run_until([this] { return leader_.engaged(); }, kComeUp, "the machine did not engage within 15 s");
}

void LedMachine::sample(const JointVector& demand) {
  const auto measured = slave_.sensors().measurement();
  if (recording_ == nullptr || !measured) return;
  recording_->samples.push_back(*measured);
  recording_->samples.back().cylinder_m += machine_.sensors.encoder_offset_m;  // as the encoder reports it
  recording_->usable.push_back(1);
  recording_->valve.push_back(demand);
}

estimation::Recording LedMachine::follow(const estimation::JointPath& path, const std::string& source) {
  const auto rests = [this](Duration time) { return [this, time] { return leader_.at_rest(access_.now(), time); }; };
  leader_.stand();
  run_until(rests(kStand), kSettle, "the machine did not come to rest within 20 s");
  leader_.follow(motion::transfer(machine_, kinematics_, leader_.machine()->position_rad, path.joint_rad.front(),
                                  to_seconds(period_)));
  run_until([this] { return leader_.engaged(); }, kRestart, "the machine did not engage again within 3 s");
  run_until([this] { return leader_.done(access_.now()); }, Duration::max() / 4, "");
  run_until(rests(kRest), kSettle, "the machine did not come to rest within 20 s");
  estimation::Recording made;
  made.source = source;
  made.step_s = to_seconds(period_);
  leader_.follow(path);
  recording_ = &made;
  run_until([this] { return leader_.done(access_.now()); }, Duration::max() / 4, "");
  recording_ = nullptr;
  return made;
}

void LedMachine::neutral() noexcept {
  try {
    leader_.stand();
    for (const Time end = access_.now() + kRelease; access_.now() < end;) advance();
  } catch (const CommissionEnded&) {
    // The nodes' own watchdogs act.
  }
}

std::vector<std::string> record_motions(const MachineDescription& machine, BusAccess& access,
                                        const IdentifyMotions& motions, const std::string& folder,
                                        const std::function<bool()>& stopped) {
  using estimation::MotionSpeed;
  std::vector<std::string> files;
  LedMachine led(machine, access, stopped);
  const auto record = [&](const char* name, const estimation::JointPath& path) {
    const std::string file = recording_file(folder, name);
    cli::OutputFile out("--record", file);
    recordings::write_recording(led.follow(path, name), out.stream());
    out.commit();
    files.push_back(file);
  };
  try {
    led.engage();
    record(kMotionNames[0], estimation::slow_sweeps(machine, motions.slow_s));
    record(kMotionNames[1], estimation::fast_excitation(machine, motions.fast_s, motions.seed));
    record(kMotionNames[2],
           estimation::held_out_motion(machine, motions.seed + 1, MotionSpeed::kSlow, motions.validation_s));
    record(kMotionNames[3],
           estimation::held_out_motion(machine, motions.seed + 2, MotionSpeed::kDigging, motions.validation_s));
  } catch (...) {
    led.neutral();
    throw;
  }
  led.neutral();
  return files;
}

}  // namespace knuckle::bringup
