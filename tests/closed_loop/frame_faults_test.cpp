// Frames that the machine sends by itself fail in each way while a machine that is led through its own controller
// moves: found, by name, in time, and nothing moves again by itself.
#include <gtest/gtest.h>

#include "machine/reason_text.h"
#include "tests/closed_loop/session_rig.h"
#include "tests/support/multiplexed_machine.h"

namespace knuckle::test {
namespace {

constexpr double kBrokenAfter_s = 3;

std::string standard200_text() {
  return whole_file(source_dir() + "/config/machines/standard200.toml", 1);
}

std::string frame_fault(const std::string& kind, const std::string& frame, double duration_s = 1) {
  return "[[fault]]\nkind = \"" + kind + "\"\nphase = \"moving\"\nafter_s = " + std::to_string(kBrokenAfter_s) +
         "\nduration_s = " + std::to_string(duration_s) + "\nframe = \"" + frame + "\"\n";
}

FinishedSession led_by_frames(const std::string& machine_text, const std::string& faults, MachineDescription& read) {
  session::SessionSetup setup;
  read = parse_machine(machine_text, "m.toml");
  setup.device = load_device(find_config("device", "knuckle1_standard200"));
  setup.scenario = session::parse_scenario(broken_while_moving(faults, 9), "s.toml", read);
  setup.truth = sim::sample_truth(read, 1);
  setup.machine = calibrated(read);
  setup.limb = sim::sample_limb(setup.scenario.limb, 1);
  setup.to_machine.delay = setup.to_operator.delay = 1ms;
  setup.seed = 1;
  return run_session(setup);
}

TEST(FrameFaults, AreFoundByNameInTimeAndTheMachineIsLedAgain) {
  struct Case {
    const char *kind, *frame, *reason;
    double most_s;  ///< From the fault to the reason.
  };
  for (const Case& c :
       {Case{"frame_silent", "front_angle", "sensor_stale: front_angle (0x18FF1021)", 0.06},
        {"frame_silent", "pilot_on", "sensor_stale: machine_state (0x18FF4021), ", 0.12},
        {"frame_frozen", "machine_state", "sensor_invalid: machine_state (0x18FF4021), ", 0.12},
        {"values_invalid", "arm_rod_pressure", "sensor_invalid: cylinder_pressure (0x18FF2021), arm_rod_pressure",
         0.05},
        {"values_invalid", "body_slope", "sensor_stale: body_slope (0x18FF3021), slope", 0.08},
        {"frame_short", "front_angle", "frame_short: front_angle (0x18FF1021), ", 0.05},
        {"frame_frozen", "front_angle", "motion_not_following: ", 2.5},
        {"values_frozen", "arm_angle", "motion_not_following: ", 2.6},
        {"frame_frozen", "cylinder_pressure", "sensor_implausible: cylinder_pressure (0x18FF2021)", 2.5}}) {
    MachineDescription read;
    const double lasts_s = c.most_s > 1 ? 4 : 0.6;
    const FinishedSession finished = led_by_frames(standard200_text(), frame_fault(c.kind, c.frame, lasts_s), read);
    const std::string about = std::string(c.kind) + " of " + c.frame;
    ASSERT_GE(finished.record.faults.size(), 1U) << about;
    const session::FaultRecord& fault = finished.record.faults.front();
    EXPECT_EQ(text_with_code(fault.reason, read.bus).rfind(c.reason, 0), 0U)
        << about << ": " << text_with_code(fault.reason, read.bus);
    EXPECT_LE(fault.at_s - fault.injected_s.value_or(0), c.most_s) << about;
    EXPECT_GT(fault.command_neutral_s, 0) << about;
    EXPECT_GT(fault.spool_neutral_s, 0) << about;
    EXPECT_EQ(finished.record.resumed_by_itself, 0) << about;
    EXPECT_EQ(finished.record.samples.back().phase, 3) << about << ": led again";
    EXPECT_EQ(finished.allocations, 0U) << about;
  }
}

/// Too old before the third of them.
TEST(FrameFaults, ACounterThatStandsIsNamedAlsoInSlowFrames) {
  const std::string slope = "period_ms = 20\n[bus.broadcast.signals]\nslope = ";
  const std::string text =
      replaced(standard200_text(), slope,
               "period_ms = 20\ncounter = { start = 24, bits = 8 }\n[bus.broadcast.signals]\nslope = ");
  MachineDescription read;
  const FinishedSession finished = led_by_frames(text, frame_fault("frame_frozen", "body_slope"), read);
  ASSERT_GE(finished.record.faults.size(), 1U);
  const std::string why = text_with_code(finished.record.faults.front().reason, read.bus);
  EXPECT_EQ(why.rfind("sensor_invalid: body_slope (0x18FF3021), slope: the counter of its frame stands: ", 0), 0U)
      << why;
}

TEST(FrameFaults, ASingleSpikeStopsNothing) {
  for (const char* const frame : {"arm_angle", "boom_head_pressure", "slope"}) {
    MachineDescription read;
    const FinishedSession finished = led_by_frames(standard200_text(), frame_fault("values_spike", frame), read);
    EXPECT_TRUE(finished.record.faults.empty())
        << frame << ": " << text_with_code(finished.record.faults.front().reason, read.bus);
  }
}

TEST(FrameFaults, AMachineWhoseReadingsAreMultiplexedIsLedAndShowsAll) {
  const std::string text =
      replaced(multiplexed(standard200_text()), "[[bus.broadcast]]\nname = \"body_slope\"",
               "[[bus.broadcast]]\nname = \"engine_1\"\nid = 0x18FF5021\nbytes = 4\nperiod_ms = 100\n"
               "multiplexer = { start = 0, bits = 2, value = 1 }\n[bus.broadcast.signals]\n"
               "engine_speed = { start = 16, bits = 16, scale = 0.125, unit = \"rpm\" }\n\n"
               "[[bus.broadcast]]\nname = \"engine_2\"\nid = 0x18FF5021\nbytes = 4\nperiod_ms = 500\n"
               "multiplexer = { start = 0, bits = 2, value = 2 }\n[bus.broadcast.signals]\n"
               "oil_temperature = { start = 16, bits = 8, scale = 1, offset = -40, unit = \"degC\" }\n"
               "coolant_temperature = { start = 24, bits = 8, scale = 1, offset = -40, unit = \"degC\" }\n\n"
               "[[bus.broadcast]]\nname = \"body_slope\"");
  MachineDescription read;
  const FinishedSession finished = led_by_frames(text, "", read);
  EXPECT_TRUE(finished.record.faults.empty()) << text_with_code(finished.record.faults.front().reason, read.bus);
  EXPECT_EQ(finished.record.samples.back().phase, 3);
  const MachineReadings& shown = finished.record.samples.back().machine.readings;
  EXPECT_NEAR(shown.engine_speed_radps, 60 * std::numbers::pi, 0.02);
  EXPECT_EQ(shown.oil_temperature_degC, 48);
  EXPECT_EQ(shown.coolant_temperature_degC, 84);
  EXPECT_EQ(finished.allocations, 0U);
}

}  // namespace
}  // namespace knuckle::test
