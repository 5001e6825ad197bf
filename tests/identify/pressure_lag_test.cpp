// Pressures and lengths of two clocks: the shift between them is found in motion alone, on machines as they are drawn.
#include <gtest/gtest.h>

#include "estimation/identification/motion.h"
#include "tests/identify/recorded_motion.h"
#include "tests/support/places.h"

namespace knuckle::identify {
namespace {

using estimation::Recording;

TEST(PressureLag, IsFoundEitherWayAndNotWhereThereIsNone) {
  for (const char* name : {"solar015", "compact080"}) {
    const MachineDescription machine = load_machine(test::source_dir() + "/config/machines/" + name + ".toml");
    const estimation::JointPath path = estimation::slow_sweeps(machine, 40);
    motion::MachineRun run(machine, sim::sample_truth(machine, 7), {}, path.joint_rad.front(), 7);
    const Recording recording = run.follow(path).recording;
    for (const double put_s : {-0.15, -0.06, 0.0, 0.06, 0.15}) {
      const auto found_s = estimation::pressure_lag_s(machine, {estimation::without_pressure_lag(recording, -put_s)});
      ASSERT_TRUE(found_s) << name;
      EXPECT_NEAR(*found_s, put_s + 0.005, 0.015) << name << ": transmitters themselves lag by 2 to 8 ms";
    }
  }
}

TEST(PressureLag, IsNoneOfAFewMoments) {
  EXPECT_FALSE(estimation::pressure_lag_s(test::solar(), {recordings::part_of(recorded_motion(), 0, 100)}));
}

TEST(PressureLag, LeavesOutSamplesWhosePressuresAreNotKnown) {
  Recording recording = recordings::part_of(recorded_motion(), 0, 100);
  recording.usable[50] = 0;
  const Recording shifted = estimation::without_pressure_lag(recording, 2.5 * recording.step_s);
  for (std::size_t i = 0; i < 100; ++i) EXPECT_EQ(shifted.usable[i], i < 97 && i != 47 && i != 48 && i != 50) << i;
  const double expected = 0.5 * (recording.samples[12].pressure_Pa[3] + recording.samples[13].pressure_Pa[3]);
  EXPECT_NEAR(shifted.samples[10].pressure_Pa[3], expected, 1e-6);
  EXPECT_EQ(shifted.samples[10].cylinder_m, recording.samples[10].cylinder_m);
}

}  // namespace
}  // namespace knuckle::identify
