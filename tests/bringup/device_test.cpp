// Doctor and calibration of a haptic device, before the simulated firmware on a cable in memory.
#include <gtest/gtest.h>

#include "app/bringup/device_calibration.h"
#include "app/bringup/device_probe.h"
#include "app/programs/device_program.h"
#include "core/error.h"
#include "machine/device_description.h"
#include "machine/load.h"
#include "sim/haptic_device.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "transport/hid_pair.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
const std::string kFile = knuckle::test::source_dir() + "/config/devices/knuckle1.toml";

/// A device as it was built, in somebody's hand, and a probe at the other end of its cable.
struct Bench {
  explicit Bench(const DeviceDescription& built, std::uint32_t serial = 77)
      : hand(built, sim::sample_limb(sim::LimbClass::kNormal, 1), cable.device(), 1, middle(built), serial) {
    intent.joint_rad = middle(built);
    intent.presence = true;
  }
  static JointVector middle(const DeviceDescription& device) {
    JointVector rad;
    for (std::size_t i = 0; i < kJoints; ++i) rad[Eigen::Index(i)] = 0.5 * (device.min_rad[i] + device.max_rad[i]);
    return rad;
  }
  void wait(Duration time) {
    for (Duration done{}; done < time; done += 1ms) {
      now += 1ms;
      cable.advance();
      if (faults) faults->step(now, hand.firmware());
      hand.step(now, intent);
    }
  }
  Time now{};
  HidPair cable;
  std::optional<programs::DeviceFaults> faults;
  sim::HandAndDevice hand;
  sim::OperatorIntent intent;
  DeviceProbe probe{cable.host(), [this](Duration time) { wait(time); }};
};

/// Does what the lines ask for: pushes each joint beyond its stop.
struct ObedientPerson {
  explicit ObedientPerson(Bench& where) : bench(where) {}
  CalibrationDialogue dialogue() {
    return {[this](const std::string& line) { said.push_back(line); },
            [this](const std::string& line) {
              for (std::size_t i = 0; i < kJoints; ++i) {
                if (line.find(kDeviceJointNames[i]) == std::string::npos) continue;
                const bool low = line.rfind("Lower", 0) == 0 || line.find(" in ") != std::string::npos;
                bench.intent.joint_rad[Eigen::Index(i)] = low ? device.min_rad[i] - 0.1 : device.max_rad[i] + 0.1;
              }
              bench.wait(3s);
              return true;
            }};
  }
  Bench& bench;
  DeviceDescription device = load_device(kFile);
  std::vector<std::string> said;
};

std::string faults_in(const Findings& findings) {
  std::string lines;
  for (const Finding& one : findings) {
    if (one.level == Finding::Level::kFault) lines += one.about + ": " + one.text + "\n";
  }
  return lines;
}

TEST(DeviceDoctor, FindsNothingWrongWithADeviceThatIsTheOneOfItsFileAndNeverCommandsIt) {
  Bench bench(load_device(kFile));
  EXPECT_EQ(faults_in(examine_device(bench.probe, load_device(kFile))), "");
  EXPECT_EQ(bench.hand.truth().motor_torque_Nm.norm(), 0);
  EXPECT_FALSE(bench.hand.firmware().latched());
}

TEST(DeviceDoctor, NamesWhatDiffersFromTheFile) {
  DeviceDescription built = load_device(kFile);
  built.gear_ratio[1] = 12;
  built.counts_per_turn[2] = 4096;
  Bench bench(built);
  const std::string lines = faults_in(examine_device(bench.probe, load_device(kFile)));
  EXPECT_TRUE(says(lines, "wrist: gear ratio 12, file 15"));
  EXPECT_TRUE(says(lines, "finger: counts per turn 4096, file 8192"));
}

TEST(DeviceDoctor, NamesWhatADamagedDeviceDoes) {
  for (const auto& [fault, said] : {std::pair{"hung@0", "does not describe itself"},
                                    {"silent@0", "no undamaged state report"},
                                    {"silent@1+0.3", "longest gap 301.0 ms"},
                                    {"bad_crc@1+0.01", "10 damaged"},
                                    {"frozen@1+0.5", "longest gap 501.0 ms"},
                                    {"wild_counts@0", "outside its range"}}) {
    Bench bench(load_device(kFile));
    bench.faults.emplace(std::vector{programs::parse_device_fault(fault)});
    EXPECT_TRUE(says(faults_in(examine_device(bench.probe, load_device(kFile))), said)) << fault;
  }
}

TEST(DeviceCalibration, FindsSignsAndZerosOfADeviceThatWasBuiltOtherwise) {
  DeviceDescription built = load_device(kFile);
  built.joint_sign = {-1, 1, 1};
  built.zero_counts = {-70000, 12345, -900};
  Bench bench(built);
  ObedientPerson person(bench);
  const auto identity = bench.probe.identity(1s);
  ASSERT_TRUE(identity);
  const auto stops = find_stops(bench.probe, *identity, person.dialogue());
  ASSERT_TRUE(stops);
  std::string problem;
  const auto device = calibrated_device(load_device(kFile), *identity, *stops, problem);
  ASSERT_TRUE(device) << problem;
  EXPECT_EQ(device->serial, 77u);
  EXPECT_EQ(device->joint_sign, built.joint_sign);
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double counts_per_deg = built.gear_ratio[i] * built.counts_per_turn[i] / 360;
    EXPECT_NEAR(device->zero_counts[i], built.zero_counts[i], 1.5 * counts_per_deg) << kDeviceJointNames[i];
  }
}

TEST(DeviceCalibration, KeepsTheFileAsItWasButForWhatItFoundOut) {
  DeviceDescription device = load_device(kFile);
  device.serial = 4000000000;
  device.joint_sign = {-1, 1, -1};
  device.zero_counts = {1, -2, 3};
  const std::string text = calibrated_device_text(knuckle::test::content(kFile), device);
  const DeviceDescription back = parse_device(text, "calibrated");
  EXPECT_EQ(back.serial, 4000000000u);
  EXPECT_EQ(back.joint_sign, device.joint_sign);
  EXPECT_EQ(back.zero_counts, device.zero_counts);
  EXPECT_EQ(back.gear_ratio, device.gear_ratio);
  EXPECT_EQ(back.feel.spring_N_per_m, device.feel.spring_N_per_m);
  EXPECT_TRUE(says(text, "# counts at 0 rad"));
  EXPECT_FALSE(says(text, "# the drive cable is crossed"));  // explained a sign that is another now
  EXPECT_EQ(calibrated_device_text(text, device), text);     // once more changes nothing
}

TEST(DeviceCalibration, RefusesAFileWhoseLayoutItCannotChange) {
  DeviceDescription device = load_device(kFile);
  device.serial = 7;
  device.zero_counts[0] += 1;
  std::string text = knuckle::test::content(kFile);
  const std::string header = "[joints.forearm]";
  text.replace(text.find(header), header.size(), "[joints.\"forearm\"]");
  EXPECT_THROW((void)calibrated_device_text(text, device), InputError);
}

TEST(DeviceCalibration, RefusesStopsThatAreNotWhereTheFileHasThem) {
  const DeviceDescription file = load_device(kFile);
  DeviceIdentity identity;
  identity.counts_per_turn = file.counts_per_turn;
  identity.torque_constant_Nm_per_A.fill(0.02F);
  StopCounts stops;
  for (std::size_t i = 0; i < kJoints; ++i) {
    identity.gear_ratio[i] = float(file.gear_ratio[i]);
    const double per_rad = file.gear_ratio[i] * file.counts_per_turn[i] / 6.283185307;
    stops.low[i] = std::int32_t(per_rad * file.min_rad[i]);
    stops.high[i] = std::int32_t(per_rad * file.max_rad[i]);
  }
  std::string problem;
  EXPECT_TRUE(calibrated_device(file, identity, stops, problem)) << problem;
  stops.high[1] -= (stops.high[1] - stops.low[1]) / 10;  // given up early
  EXPECT_FALSE(calibrated_device(file, identity, stops, problem));
  EXPECT_EQ(problem.rfind("wrist: measured 1.867 rad between its stops, file 2.075 rad", 0), 0u) << problem;
}

TEST(DeviceCalibration, AsksAgainWhereTheJointWasNotHeldStill) {
  Bench bench(load_device(kFile));
  const auto identity = bench.probe.identity(1s);
  ASSERT_TRUE(identity);
  int asked = 0;
  std::vector<std::string> said;
  EXPECT_FALSE(find_stops(bench.probe, *identity,
                          {[&](const std::string& line) { said.push_back(line); },
                           [&](const std::string&) {
                             bench.intent.joint_rad[0] += 0.3;  // and the hand only follows while it is listened to
                             return ++asked <= 2;
                           }}));
  EXPECT_EQ(asked, 3);
  ASSERT_EQ(said.size(), 2u);
  EXPECT_TRUE(says(said[0], "while it was sampled, limit 1.1 deg"));
}

TEST(DeviceDoctor, KnowsTwoBackEnds) {
  EXPECT_EQ(knuckle::test::refusal([] { return open_device_port("--device", "serial", {}); }),
            "--device serial: must be one of hid, usb");
}

TEST(DeviceFaults, ThatCannotBeReadAreRefusedWithTheKindsThereAre) {
  for (const char* text : {"", "silent", "loud@1", "silent@", "silent@-1", "silent@1+", "silent@1+x"}) {
    EXPECT_THROW((void)programs::parse_device_fault(text), InputError) << text;
  }
  const programs::PlannedDeviceFault fault = programs::parse_device_fault("bad_crc@5+0.1");
  EXPECT_EQ(fault.kind, sim::FirmwareFault::kBadCrc);
  EXPECT_EQ(fault.at_s, 5);
  EXPECT_EQ(fault.duration_s, 0.1);
}

}  // namespace
}  // namespace knuckle::bringup
