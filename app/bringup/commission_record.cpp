#include "app/bringup/commission_record.h"

#include "app/bringup/commission_dialogue.h"
#include "app/cli/output_file.h"
#include "app/motion/led_machine.h"
#include "app/recordings/recording_reader.h"
#include "estimation/identification/excitation.h"

namespace knuckle::bringup {
namespace {

constexpr Duration kStill = 1500ms;

/// Gently to the path's first point, then along it; only that is recorded.
estimation::Recording follow(motion::LedMachine& led, const estimation::JointPath& path, const std::string& source) {
  led.go_to(path.joint_rad.front());
  led.rest(kStill);
  estimation::Recording made;
  made.source = source;
  made.step_s = to_seconds(led.period());
  led.lead(path);
  while (!led.done()) (void)led.record(made);
  return made;
}

}  // namespace

std::vector<std::string> record_motions(const MachineDescription& machine, BusAccess& access,
                                        const IdentifyMotions& motions, const std::string& folder,
                                        const std::function<bool()>& stopped) {
  using estimation::MotionSpeed;
  std::vector<std::string> files;
  motion::LedMachine led(machine, access, access.now());
  led.each_step = [&stopped] {
    if (stopped()) throw CommissionEnded("stopped from the keyboard");
  };
  const auto record = [&](const char* name, const estimation::JointPath& path) {
    const std::string file = recording_file(folder, name);
    cli::OutputFile out("--record", file);
    recordings::write_recording(follow(led, path, name), out.stream());
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
  } catch (const motion::NotLed& ended) {
    led.neutral();
    throw CommissionEnded(ended.what());
  } catch (...) {
    led.neutral();
    throw;
  }
  led.neutral();
  return files;
}

}  // namespace knuckle::bringup
