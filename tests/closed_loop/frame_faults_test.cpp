// Frames that the machine sends by itself fail in each way while a machine that is led through its own controller
// moves: found, by name, in time, and nothing moves again by itself.
#include <gtest/gtest.h>

#include "machine/reason_text.h"
#include "tests/closed_loop/session_rig.h"
#include "tests/support/says.h"

namespace knuckle::test {
namespace {

std::string frame_fault(const std::string& kind, const std::string& frame, double duration_s, double after_s = 3) {
  return "[[fault]]\nkind = \"" + kind + "\"\nphase = \"moving\"\nafter_s = " + std::to_string(after_s) +
         "\nduration_s = " + std::to_string(duration_s) + "\nframe = \"" + frame + "\"\n";
}

const MachineDescription& standard200() {
  static const MachineDescription machine = load_machine(find_config("machine", "standard200"));
  return machine;
}

FinishedSession led_by_frames(const std::string& faults) {
  return run_broken_while_moving(standard200(), "knuckle1_standard200", faults, 9);
}

struct FrameFaultCase {
  const char *kind, *frame, *reason;
  double most_s;  ///< From the fault to the reason.
};

void expect_found_and_led_again(const FrameFaultCase& c) {
  const double lasts_s = c.most_s > 1 ? 4 : 0.6;
  const FinishedSession finished = led_by_frames(frame_fault(c.kind, c.frame, lasts_s));
  const std::string about = std::string(c.kind) + " of " + c.frame;
  ASSERT_GE(finished.record.faults.size(), 1U) << about;
  const session::FaultRecord& fault = finished.record.faults.front();
  EXPECT_TRUE(begins(text_with_code(fault.reason, standard200().bus), c.reason)) << about;
  EXPECT_LE(fault.at_s - fault.injected_s.value_or(0), c.most_s) << about;
  EXPECT_GT(fault.command_neutral_s, 0) << about;
  EXPECT_GT(fault.spool_neutral_s, 0) << about;
  expect_led_again(finished, about);
}

TEST(FrameFaults, AreFoundByNameInTimeAndTheMachineIsLedAgain) {
  for (const FrameFaultCase& c :
       {FrameFaultCase{"frame_silent", "front_angle", "sensor_stale: front_angle (0x18FF1021)", 0.06},
        {"frame_frozen", "machine_state", "sensor_invalid: machine_state (0x18FF4021), ", 0.12},
        {"values_invalid", "arm_rod_pressure", "sensor_invalid: cylinder_pressure (0x18FF2021), arm_rod_pressure",
         0.05},
        {"values_invalid", "body_slope", "sensor_stale: body_slope (0x18FF3021), slope", 0.08},
        {"frame_short", "front_angle", "frame_short: front_angle (0x18FF1021), ", 0.05},
        {"frame_frozen", "front_angle", "motion_not_following: ", 2.5},
        {"frame_frozen", "cylinder_pressure", "sensor_implausible: cylinder_pressure (0x18FF2021)", 2.5}})
    expect_found_and_led_again(c);
}

TEST(DeepFrameFaults, OfMoreFramesAreFoundByNameInTime) {
  expect_found_and_led_again({"frame_silent", "pilot_on", "sensor_stale: machine_state (0x18FF4021), ", 0.12});
  expect_found_and_led_again({"values_frozen", "arm_angle", "motion_not_following: ", 2.6});
}

TEST(FrameFaults, ASingleSpikeStopsNothing) {
  const FinishedSession finished = led_by_frames(frame_fault("values_spike", "arm_angle", 1, 3) +
                                                 frame_fault("values_spike", "boom_head_pressure", 1, 5) +
                                                 frame_fault("values_spike", "slope", 1, 7));
  EXPECT_EQ(finished.record.injected_s.size(), 3U);
  EXPECT_TRUE(finished.record.faults.empty())
      << text_with_code(finished.record.faults.front().reason, standard200().bus);
}

}  // namespace
}  // namespace knuckle::test
