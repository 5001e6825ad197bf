// Sensors in frames that the machine sends by itself: read by literal bytes, coarse, missed, and led with.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "machine/reason_text.h"
#include "slave/j1939_bus.h"
#include "slave/plausibility.h"
#include "slave/sensors.h"
#include "tests/slave/reasons.h"
#include "tests/support/multiplexed_machine.h"
#include "tests/support/says.h"

namespace knuckle::slave {
namespace {

constexpr std::uint32_t kFrontAngle = 0x18FF1021U | kExtendedId, kPressureFrame = 0x18FF2021U | kExtendedId,
                        kBodyFrame = 0x1A5;

MachineDescription calibrated_broadcasts() {
  return calibrated(test::broadcast_machine());
}

/// CRC-8 of SAE J1850, bit by bit.
std::uint8_t j1850(std::initializer_list<std::uint8_t> bytes) {
  unsigned crc = 0xFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x80) != 0 ? (crc << 1 ^ 0x1D) & 0xFF : crc << 1;
  }
  return static_cast<std::uint8_t>(crc ^ 0xFF);
}

struct FedSet {
  explicit FedSet(MachineDescription of) : machine(std::move(of)) {}
  [[nodiscard]] std::string fault() const {
    const Reason why = sensors.fault(now);
    return why ? text_with_code(why, machine.bus) : "";
  }
  MachineDescription machine;
  SensorSet sensors{machine};
  Time now{1s};
};

/// Boom 0.32, arm -1.5 and bucket -0.8 rad; 5.2 MPa in each chamber; slope 3 deg.
struct FedBroadcasts : FedSet {
  explicit FedBroadcasts(const MachineDescription& of = calibrated_broadcasts()) : FedSet(of) {}
  void feed(int times = 1) {
    for (int n = 0; n < times; ++n) {
      now += 10ms;
      if (front) sensors.receive(*front, now);
      if (pressures) sensors.receive(*pressures, now);
      if (!body) continue;
      if (counts) body->data[2] = static_cast<std::uint8_t>((body->data[2] + 1) % 15);
      if (sums) body->data[3] = j1850({body->data[0], body->data[1], body->data[2], 0x5A});
      sensors.receive(*body, now);
    }
  }
  // raw: (0.12 - 0.32 + 10) / 0.0004 = 24500 = 0x5FB4; (-1.5 + 10) / 0.0004 = 21250 = 0x5302; -0.8 rad = -4584 = 0xEE18
  std::optional<CanFrame> front = CanFrame{kFrontAngle, 8, {0xB4, 0x5F, 0x02, 0x53, 0xEE, 0x18, 0, 0}};
  std::optional<CanFrame> pressures = CanFrame{kPressureFrame, 6, {76, 76, 76, 76, 76, 76}};
  std::optional<CanFrame> body = CanFrame{kBodyFrame, 4, {0x2C, 0x01}};  // 300
  bool counts = true, sums = true;
};

TEST(Broadcasts, AreReadByTheirBits) {
  FedBroadcasts fed;
  fed.feed();
  EXPECT_EQ(fed.fault(), "");
  const auto measured = fed.sensors.measurement();
  ASSERT_TRUE(measured);
  const Kinematics kinematics(fed.machine);
  EXPECT_NEAR(measured->cylinder_m[kBoom], kinematics.cylinder_at(kBoom, 0.32)->length_m, 1e-9);
  EXPECT_NEAR(measured->cylinder_m[kArm], kinematics.cylinder_at(kArm, -1.5)->length_m, 1e-9);
  EXPECT_NEAR(measured->cylinder_m[kBucket],
              kinematics.cylinder_at(kBucket, -4584 * std::numbers::pi / 18000)->length_m, 1e-9);
  for (const double pressure_Pa : measured->pressure_Pa) EXPECT_NEAR(pressure_Pa, 5.2e6, 1);
  EXPECT_NEAR(measured->hull_pitch_rad, 3 * std::numbers::pi / 180, 1e-9);
}

TEST(Broadcasts, ARawValueThatSaysThereIsNoneIsAFaultByTheSignalsName) {
  FedBroadcasts fed;
  fed.feed();
  fed.pressures->data[3] = 0xFB;
  fed.feed(2);
  EXPECT_EQ(fed.fault(), "") << "single ones are left out";
  EXPECT_NEAR(fed.sensors.measurement()->pressure_Pa[3], 5.2e6, 1);
  fed.feed();
  EXPECT_TRUE(test::begins(fed.fault(), "sensor_invalid: pressure_1 (0x18FF2021), arm_rod_pressure: "));
  fed.pressures->data[3] = 0xFA;  // 40 MPa is a value, but none that the transmitter has
  fed.feed();
  EXPECT_NE(fed.fault(), "");
  fed.pressures->data[3] = 76;
  fed.feed();
  EXPECT_EQ(fed.fault(), "");
}

/// How a frame can be closed wrongly, and what is said of it.
struct Closing {
  const char* said;
  void (*breaks)(FedBroadcasts& fed);
};
const Closing kWrongSum{"the checksum of its frame is wrong: ",
                        [](FedBroadcasts&fed) {
                          fed.sums = false;
                          fed.body->data[3] ^= 1U;
                        }},
    kStands{"the counter of its frame stands: ", [](FedBroadcasts&fed) { fed.counts = false; }},
    kBeyondItsModulus{"", [](FedBroadcasts&fed) {
                        fed.counts = false;
                        fed.body->data[2] = 15;
                      }};
const std::string kOfBody = "sensor_invalid: body (0x1A5), slope: ";

TEST(Broadcasts, ACounterThatStandsAndAWrongChecksumMakeValuesNone) {
  for (const Closing& closing : {kStands, kWrongSum, kBeyondItsModulus}) {
    FedBroadcasts fed;
    fed.feed(20);  // the counter begins anew
    EXPECT_EQ(fed.fault(), "");
    closing.breaks(fed);
    fed.body->data[0] = 0;
    fed.feed(2);
    EXPECT_EQ(fed.fault(), "") << "single ones are left out";
    EXPECT_NEAR(fed.sensors.measurement()->hull_pitch_rad, 3 * std::numbers::pi / 180, 1e-9);
    fed.feed();
    EXPECT_TRUE(test::begins(fed.fault(), kOfBody + closing.said));
    fed.counts = fed.sums = true;
    fed.feed();
    EXPECT_EQ(fed.fault(), "");
  }
}

TEST(Broadcasts, WhatIsTooOldBecauseItsFramesDidNotCountSaysWhy) {
  MachineDescription machine = calibrated_broadcasts();
  machine.bus.sensor_age_limit_s = 0.015;
  machine.bus.tilt_every_nth_sync = 1;
  for (const Closing& closing : {kStands, kWrongSum}) {
    FedBroadcasts fed(machine);
    fed.feed(3);
    closing.breaks(fed);
    fed.feed(1);
    EXPECT_EQ(fed.fault(), "");
    fed.feed(1);
    EXPECT_TRUE(test::begins(fed.fault(), kOfBody + closing.said));
  }
}

TEST(Broadcasts, WhatIsNoNumberIsNeverAValue) {
  const std::string all = test::kBroadcasts, closed = all.substr(all.find("counter = "));
  for (const auto mount : {SensorDescription::TiltMount::kOnHull, SensorDescription::TiltMount::kOnBoom}) {
    for (const std::uint32_t bits : {0x7FC00000U, 0x7F800000U, 0xFF800000U}) {  // NaN, inf, -inf
      MachineDescription machine = test::broadcast_machine(
          closed,
          "[bus.broadcast.signals]\nslope = { start = 0, bits = 32, type = \"float\", scale = 1, unit = \"rad\" }\n");
      machine.sensors.tilt_mount = mount;
      FedBroadcasts fed(machine);
      fed.counts = fed.sums = false;
      fed.body = CanFrame{kBodyFrame, 4, {0x0A, 0xD7, 0xA3, 0x3E}};  // 0.32
      fed.feed();
      ASSERT_EQ(fed.fault(), "");
      for (std::size_t byte = 0; byte < 4; ++byte) fed.body->data[byte] = static_cast<std::uint8_t>(bits >> 8 * byte);
      for (int n = 0; n < 100; ++n) {
        fed.feed();
        ASSERT_TRUE(std::isfinite(fed.sensors.measurement()->hull_pitch_rad)) << n;
      }
      EXPECT_NE(fed.fault(), "");
    }
  }
}

TEST(Broadcasts, AFrameThatWasLostIsNoFault) {
  FedBroadcasts fed;
  fed.feed(3);
  fed.body->data[2] = static_cast<std::uint8_t>((fed.body->data[2] + 3) % 15);
  fed.feed();
  EXPECT_EQ(fed.fault(), "");
  EXPECT_EQ(fed.sensors.newest_at(), fed.now);
}

TEST(Broadcasts, SilenceAndShortFramesAreToldByName) {
  FedBroadcasts silent;
  silent.feed();
  silent.body.reset();
  silent.feed(5);
  EXPECT_EQ(silent.fault(), "") << "50 ms are allowed";
  silent.feed();
  EXPECT_TRUE(test::begins(silent.fault(), "sensor_stale: body (0x1A5), slope: "));
  FedBroadcasts cut;
  cut.feed();
  cut.pressures->size = 5;
  cut.feed(3);
  EXPECT_EQ(
      cut.fault(),
      "frame_short: pressure_1 (0x18FF2021), boom_head_pressure: frame is too short to be used: what sends it was "
      "changed, or its bytes in the machine file are wrong (it has 5, and 6 in the file)");
}

/// Of pressures in steps of 2 bar. @param travel_mps of the arm's cylinder. @return the first fault.
Reason coarse_fault(double other_swing_Pa, double travel_mps, Duration time) {
  const MachineDescription machine = calibrated_broadcasts();
  Plausibility plausibility(machine, 5e-3);
  const Kinematics kinematics(machine);
  estimation::Measurement m;
  m.pressure_Pa.fill(5.2e6);
  for (int i = 0; i < kJoints; ++i)
    m.cylinder_m[i] = kinematics.cylinder_at(i, JointVector(0.32, -1.5, -0.8)[i])->length_m;
  JointVector spool = JointVector::Zero();
  spool[kArm] = travel_mps == 0 ? 0 : 0.5;
  for (int step = 0; step * 5ms < time; ++step) {
    m.pressure_Pa[3] = 5.2e6 + other_swing_Pa * std::sin(0.05 * step);
    m.cylinder_m[kArm] += travel_mps * 5e-3;
    if (const Reason why = plausibility.step(m, spool, {})) return why;
  }
  return {};
}

TEST(Broadcasts, ACoarseTransmitterThatStaysWithinAStepIsNotCalledStuck) {
  EXPECT_FALSE(coarse_fault(0, 0.01, 12s)) << "12 cm of travel at the same pressure";
  EXPECT_FALSE(coarse_fault(9e5, 0, 30s)) << "the other side alone, by less than ten steps";
  EXPECT_FALSE(coarse_fault(30e5, 0, 9s)) << "a chamber may stand within a step for seconds";
  EXPECT_TRUE(test::is(coarse_fault(0, 0.05, 4s), ReasonCode::kSensorImplausible))
      << "no pressure at all changes in 15 cm";
  const Reason why = coarse_fault(30e5, 0, 20s);
  EXPECT_TRUE(test::is(why, ReasonCode::kSensorImplausible));
  EXPECT_EQ(subject_text(why, calibrated_broadcasts().bus), "pressure_1 (0x18FF2021), arm_head_pressure");
}

// Several frames under one identifier: each value from its own, the counter over all of them, one sender.

/// Angles and pressures in turn, every 5 ms a frame; 52 bar in each chamber.
struct FedInTurn : FedSet {
  FedInTurn() : FedSet(calibrated(test::multiplexed_machine())) {}
  void feed(int times = 1) {
    for (int n = 0; n < times; ++n) {
      for (const bool angles : {true, false}) {
        now += 5ms;
        if (angles ? !with_angles : !with_pressures) continue;
        CanFrame frame{kFrontAngle, 8, {76, 76, 76, 76, 76, 76, 0, 2}};
        if (angles) frame.data = {0xB4, 0x5F, 0x02, 0x53, 0xEE, 0x18, 0, 1};
        if (counts) count = (count + 1) % 16;
        frame.data[6] = static_cast<std::uint8_t>(angles ? angles_count.value_or(count) : count);
        sensors.receive(frame, now);
      }
      CanFrame body{kBodyFrame, 4, {0, 0, static_cast<std::uint8_t>(++body_count % 15)}};
      close_frame(machine.bus.broadcasts.at(2).closing, body_count % 15, body);
      sensors.receive(body, now);
    }
  }
  std::uint64_t body_count = 0;
  unsigned count = 0;
  std::optional<unsigned> angles_count{};  // stands
  bool counts = true, with_angles = true, with_pressures = true;
};

TEST(Multiplexed, EachValueIsReadFromItsOwnFramesAlone) {
  FedInTurn fed;
  fed.feed(50);
  EXPECT_EQ(fed.fault(), "");
  const auto measured = fed.sensors.measurement();
  ASSERT_TRUE(measured);
  EXPECT_NEAR(measured->cylinder_m[kBoom], Kinematics(fed.machine).cylinder_at(kBoom, 0.32)->length_m, 1e-9);
  for (const double pressure_Pa : measured->pressure_Pa) EXPECT_NEAR(pressure_Pa, 5.2e6, 1);
}

TEST(Multiplexed, OneThatNoLongerComesIsTold) {
  FedInTurn fed;
  fed.feed(10);
  fed.with_pressures = false;
  fed.feed(6);
  EXPECT_TRUE(test::begins(fed.fault(), "sensor_stale: pressure_1 (0x18FF1021), boom_head_pressure: "));
}

TEST(Multiplexed, OneCountForEachOfTheFramesIsNoneThatStands) {
  BusDescription bus = test::multiplexed_machine().bus;
  for (BroadcastFrame& frame : bus.broadcasts)
    if (frame.multiplexer) frame.closing.counter->modulus = 2;
  ClosedFrames frames(bus);
  for (std::uint8_t n = 0; n < 40; ++n) {
    const auto count = static_cast<std::uint8_t>(n % 2), value = static_cast<std::uint8_t>(1 + n % 2);
    EXPECT_EQ(frames.fault({kFrontAngle, 8, {0, 0, 0, 0, 0, 0, count, value}}), FrameFault::kNone) << int{n};
  }
}

TEST(Multiplexed, OneThatComesAgainAndAgainAmongLivingOnesIsFound) {
  FedInTurn fed;
  fed.feed(20);
  ASSERT_EQ(fed.fault(), "");
  fed.angles_count = fed.count;
  fed.feed(8);
  EXPECT_FALSE(test::begins(fed.fault(), "sensor_invalid: pressure"));
  EXPECT_TRUE(test::says(fed.fault(), "_angle"));
}

TEST(Multiplexed, AGroupHasOneSenderWhateverItsMultiplexerSays) {
  std::string text = test::multiplexed(test::kBroadcasts);
  for (int n = 0; n < 2; ++n) text = test::replaced(text, "id = 0x18FF1021", "pgn = 0xFF10");
  const BusDescription bus = parse_machine(test::broadcast_text(text), "m.toml").bus;
  J1939Bus groups(bus);
  Time now{1s};
  for (const std::uint8_t value : {std::uint8_t{1}, std::uint8_t{2}}) {
    CanFrame from_21{0x18FF1021U | kExtendedId, 8, {0, 0, 0, 0, 0, 0, 0, value}};
    EXPECT_TRUE(groups.receive(from_21, now));
    EXPECT_EQ(from_21.id, bus.broadcasts[0].id);
  }
  EXPECT_FALSE(groups.fault(now));
  CanFrame from_22{0x18FF1022U | kExtendedId, 8, {0, 0, 0, 0, 0, 0, 0, 2}};
  EXPECT_FALSE(groups.receive(from_22, now)) << "its values are none";
  EXPECT_TRUE(test::is(groups.fault(now), ReasonCode::kGroupTwice));
}

}  // namespace
}  // namespace knuckle::slave
