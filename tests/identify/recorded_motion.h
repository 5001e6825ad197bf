// One recording of the simulated machine in slow and fast motion, made once and shared by tests.
#pragma once

#include "app/motion/machine_run.h"
#include "app/recordings/recording_reader.h"
#include "estimation/identification/excitation.h"
#include "machine/load.h"
#include "tests/support/places.h"
#include "tests/support/solar.h"

namespace knuckle::identify {

/// 40 s of slow sweeps.
inline const estimation::Recording& recorded_motion() {
  static const estimation::Recording recording = [] {
    const MachineDescription& machine = test::solar();
    const estimation::JointPath path = estimation::slow_sweeps(machine, 40);
    motion::MachineRun run(machine, sim::sample_truth(machine, 3), {}, path.joint_rad.front(), 5);
    return run.follow(path).recording;
  }();
  return recording;
}

/// As if it came from a file of Knuckle's: sample i is row i + 2.
inline recordings::RecordedFile as_file(const estimation::Recording& recording) {
  recordings::RecordedFile file{recording, {}, {}, recording.samples.size(), {}};
  for (std::size_t c = 0; c < recordings::kSignalChannels; ++c) file.columns[c] = recordings::kSignalNames[c];
  for (std::size_t i = 0; i < recording.samples.size(); ++i) file.rows.push_back(i + 2);
  return file;
}

}  // namespace knuckle::identify
