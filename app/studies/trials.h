// What a force estimate is judged by: free motion, a test rig's known pulls, contact steps and weighed loads, driven on
// the simulated machine through the wires and recorded together with the truth. The estimators run on the recordings
// afterwards, so that every method sees the same data.
#pragma once

#include <cstdint>
#include <vector>

#include "app/motion/machine_run.h"
#include "app/studies/test_rig.h"
#include "machine/description.h"
#include "sim/truth.h"

namespace knuckle::studies {

/// One weight, lifted and lowered slowly.
struct Lift {
  motion::MachineRecording run;
  double mass_kg = 0;
};

struct Trials {
  motion::MachineRecording warm_up;  ///< 20 s of free motion: today's oil.
  motion::MachineRecording slow;     ///< Free motion at 2-4 cm/s of the cylinders.
  motion::MachineRecording digging;  ///< At digging speed.
  motion::MachineRecording pulls;
  std::vector<Press> presses;
  motion::MachineRecording knocks;    ///< 500 N steps in slow motion.
  std::vector<std::size_t> knock_at;  ///< First sample that has the force.
  Lift empty;                         ///< The zero of the scale.
  std::vector<Lift> lifts;
};

/// Length of each kind of trial; shorter ones for tests.
struct TrialPlan {
  double slow_s = 30, digging_s = 30;
  int presses = 12, knocks = 8, lifts = 2;
  double from_tip_m = 0;  ///< Where pulls and knocks act: from the tip towards the bucket pin.
  sim::HullTruth hull;    ///< A test rig pulls no machine over that stands on compliant ground.
};

/// @param machine as the controller sees it. Same seed, same motions and loads.
[[nodiscard]] Trials run_trials(motion::MachineRun& run, const MachineDescription& machine, const TrialPlan& plan,
                                std::uint64_t seed);

}  // namespace knuckle::studies
