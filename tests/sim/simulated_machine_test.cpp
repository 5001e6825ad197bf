#include <gtest/gtest.h>

#include <utility>

#include "machine/load.h"
#include "sim/machine_on_bus.h"
#include "tests/sim/can_rig.h"
#include "tests/support/no_alloc.h"
#include "tests/support/places.h"
#include "tests/support/sensor_frames.h"

namespace knuckle::sim::rig {
namespace {

const std::string kFile = knuckle::test::source_dir() + "/config/machines/solar015.toml";
const JointVector kStartPose(0.3, -1.4, -0.8);

struct MachineRig : BusRig {
  explicit MachineRig(const MachineTruth& truth, std::uint64_t seed = 1)
      : machine(truth, WorldDescription{}, kStartPose, bus.port(1), seed) {
    step = [this](Time at) { machine.step(at); };
    start();
  }
  double pressure(unsigned chamber) const {
    return canopen::parse_pressure(newest(0x1A0 + chamber)->frame)->pressure_Pa;
  }
  SimulatedMachine machine;
};

MachineTruth sampled() {
  return sample_truth(load_machine(kFile), 3);
}

TEST(SimulatedMachine, SaysOnTheBusWhatItsSensorsMeasureErrorsIncluded) {
  MachineTruth truth = sampled();
  for (auto& sensor : truth.pressure) sensor.noise_Pa = 0;
  truth.tilt_noise_rad = 0;
  MachineRig rig(truth);
  rig.run(300ms);
  const PlantState& state = rig.machine.plant().state();
  for (unsigned i = 0; i < 6; ++i) {
    EXPECT_NEAR(rig.pressure(i), truth.pressure[i].gain * state.transmitter_Pa[i] + truth.pressure[i].offset_Pa, 1e4);
  }
  for (unsigned j = 0; j < 3; ++j) {
    const auto axis = static_cast<int>(j);
    EXPECT_NEAR(canopen::parse_encoder(rig.newest(0x1B0 + j)->frame)->position_m,
                state.cylinder_m[axis] + truth.encoder_offset_m[axis], 1.1e-4);
  }
  EXPECT_NEAR(*canopen::parse_tilt(rig.newest(0x1B8)->frame), state.tilt_hull_rad + truth.tilt_offset_rad,
              canopen::kTiltStep_rad);
}

TEST(SimulatedMachine, PressureReadingsLagByTheTimeConstantOfTheTransmitters) {
  // Of a first-order lag y of p: integral of (p - y) = time constant * change of y.
  constexpr double kLag_s = 8e-3;
  MachineTruth truth = nominal_truth(load_machine(kFile));
  for (auto& sensor : truth.pressure) sensor.noise_Pa = 0;
  MachineRig sharp(truth);
  for (auto& sensor : truth.pressure) sensor.lag_s = kLag_s;
  MachineRig slow(truth);
  const double before = slow.pressure(0);
  sharp.machine.plant().set_pull({0, -3000});
  slow.machine.plant().set_pull({0, -3000});
  double behind = 0;
  for (int i = 0; i < 1500; ++i) {
    sharp.run(1ms);
    slow.run(1ms);
    behind += 1e-3 * (sharp.pressure(0) - slow.pressure(0));
  }
  const double rise = slow.pressure(0) - before;
  ASSERT_GT(rise, 20e5);
  EXPECT_NEAR(behind, kLag_s * rise, 0.6e-3 * rise);  // the filter's step is a millisecond
}

TEST(SimulatedMachine, EncodersAreAsNoisyAsTheirTruth) {
  MachineTruth truth = nominal_truth(load_machine(kFile));
  truth.encoder_noise_m = 3e-4;
  MachineRig rig(truth);
  double sum = 0, squares = 0;
  constexpr int kReadings = 400;
  for (int i = 0; i < kReadings; ++i) {
    rig.run(5ms);
    const double error =
        canopen::parse_encoder(rig.newest(0x1B1)->frame)->position_m - rig.machine.plant().state().cylinder_m[kArm];
    sum += error;
    squares += error * error;
  }
  EXPECT_NEAR(sum / kReadings, 0, 6e-5);
  EXPECT_NEAR(std::sqrt(squares / kReadings), 3e-4, 5e-5);  // steps of 0.1 mm add next to nothing
}

TEST(SimulatedMachine, ValvesCloseInAStallOfTheWholeProgramAsTheirWatchdogsPromise) {
  MachineRig rig(nominal_truth(load_machine(kFile)));
  rig.command[kBoom].set_point = 0.5;
  rig.run(500ms);
  const PlantState& plant = rig.machine.plant().state();
  const double before_m = plant.cylinder_m[kBoom];
  rig.run(100ms);
  const double in_100ms_m = plant.cylinder_m[kBoom] - before_m;
  ASSERT_GT(in_100ms_m, 1e-3);
  const double stalled_m = plant.cylinder_m[kBoom];
  rig.machine.step(rig.now + 10s);  // neither bus nor controller did anything meanwhile
  EXPECT_LT(plant.cylinder_m[kBoom] - stalled_m, 3.2 * in_100ms_m) << "320 ms, as with a hung controller";
  EXPECT_LT(std::abs(plant.spool[kBoom]), 0.05);
}

TEST(SimulatedMachine, ALateThreadOfItsOwnStopsNoMachineWhoseControllerGoesOn) {
  MachineRig rig(nominal_truth(load_machine(kFile)));
  rig.command[kBoom].set_point = 0.5;
  rig.run(500ms);
  const auto step = std::exchange(rig.step, [](Time) {});
  rig.run(150ms);  // the controller goes on
  rig.step = step;
  const double before_m = rig.machine.plant().state().cylinder_m[kBoom];
  rig.run(300ms);
  EXPECT_GT(rig.machine.plant().state().cylinder_m[kBoom] - before_m, 5e-3);
  EXPECT_GT(rig.machine.plant().state().spool[kBoom], 0.2);
}

TEST(SimulatedMachine, RepeatsEveryFrameForASeedAndAllocatesNothingWhileStepping) {
  MachineRig first(sampled()), second(sampled()), other(sampled(), 2);
  for (MachineRig* rig : {&first, &second, &other}) {
    rig->command[0].set_point = 0.4;
    const knuckle::test::NoAllocScope scope;
    rig->run(300ms);
    const auto allocations = scope.allocations();
    EXPECT_EQ(allocations, 0U);
  }
  const auto same = [](const Heard& a, const Heard& b) { return a.at == b.at && a.frame == b.frame; };
  EXPECT_TRUE(std::equal(first.heard.begin(), first.heard.end(), second.heard.begin(), second.heard.end(), same));
  EXPECT_FALSE(std::equal(first.heard.begin(), first.heard.end(), other.heard.begin(), other.heard.end(), same));
}

}  // namespace
}  // namespace knuckle::sim::rig
