// Frames that the machine sends by itself, from its end: by its own clock, in the bits of the file.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numbers>

#include "sim/machine_faults.h"
#include "tests/sim/can_rig.h"
#include "tests/support/multiplexed_machine.h"

namespace knuckle::sim::rig {
namespace {

/// All that was sent under an identifier in 100 ms, whoever controls the nodes or not.
/// @param meddle once, half-way
std::vector<Heard> broadcasts_under(
    std::uint32_t id, const SensorErrors& errors = {},
    const MachineDescription& machine = knuckle::test::broadcast_machine(),
    const std::function<void(CanNodes&)>& meddle = [](CanNodes&) {}) {
  MachineSignals signals;
  signals.shaft_rad = JointVector(0.32, -1.5, -0.8);
  signals.pressure_Pa.fill(5.2e6);
  signals.pressure_Pa[1] = 5.31e6;
  signals.pressure_Pa[2] = 60e6;
  signals.slope_rad = -3 * std::numbers::pi / 180;
  CanNodes* nodes = nullptr;
  BusRig rig([&](Time now) { nodes->step(now, signals); });
  CanNodes there(machine, errors, rig.bus.port(1), 1);
  nodes = &there;
  rig.run(50ms);
  meddle(there);
  rig.run(50ms);
  std::vector<Heard> of;
  for (const Heard& heard : rig.heard)
    if (heard.frame.id == id) of.push_back(heard);
  return of;
}

TEST(Broadcasts, AreSentByTheirPeriodsInTheFilesBits) {
  const std::vector<Heard> front = broadcasts_under(0x18FF1021 | kExtendedId), body = broadcasts_under(0x1A5);
  ASSERT_EQ(front.size(), 10U);
  ASSERT_EQ(body.size(), 5U);
  EXPECT_NEAR(to_seconds(front[3].at - front[2].at), 0.01, 5e-4) << "it may wait for another frame";
  EXPECT_EQ(front[0].frame.size, 8);
  EXPECT_EQ(front[0].frame.data, (std::array<std::uint8_t, 8>{0xB4, 0x5F, 0x02, 0x53, 0xEE, 0x18, 0, 0}));
  ASSERT_EQ(body[1].frame.size, 4);
  EXPECT_EQ(body[1].frame.data[0], 0xD4) << "-300";
  EXPECT_EQ(body[1].frame.data[1], 0xFE);
  EXPECT_EQ(body[1].frame.data[2] - body[0].frame.data[2], 1) << "the counter";
  EXPECT_EQ(body[1].frame.data[2], 1);
  EXPECT_EQ(body[1].frame.data[3], 0x52) << "SAE J1850 of D4 FE 01 5A";
}

TEST(Broadcasts, AValueThatDoesNotFitIsTheHighestThatIsOne) {
  const std::vector<Heard> pressures = broadcasts_under(0x18FF2021 | kExtendedId);
  ASSERT_FALSE(pressures.empty());
  EXPECT_EQ(pressures[0].frame.size, 6);
  EXPECT_EQ(pressures[0].frame.data, (std::array<std::uint8_t, 8>{76, 77, 0xFA, 76, 76, 76, 0, 0}));
}

TEST(Broadcasts, HaveTheSensorsErrors) {
  SensorErrors errors;
  errors.pressure_offset_Pa[0] = 4e5;
  errors.pressure_noise_Pa[5] = 5e5;
  const std::vector<Heard> pressures = broadcasts_under(0x18FF2021 | kExtendedId, errors);
  EXPECT_EQ(pressures[0].frame.data[0], 78);
  EXPECT_TRUE(std::any_of(pressures.begin(), pressures.end(), [](const Heard& h) { return h.frame.data[5] != 76; }));
}

TEST(Broadcasts, AMultiplexerTellsFramesOfOneIdentifierApartAndTheCounterRunsOverAll) {
  const MachineDescription machine = knuckle::test::multiplexed_machine("period_ms = 10", "period_ms = 20");
  const std::vector<Heard> both = broadcasts_under(0x18FF1021 | kExtendedId, {}, machine);
  std::array<int, 3> count{};
  for (std::size_t n = 0; n < both.size(); ++n) {
    const auto& data = both[n].frame.data;
    ASSERT_LE(data[7], 2);
    ++count.at(data[7]);
    EXPECT_EQ(data[6], n % 16);
    if (data[7] == 1)
      EXPECT_EQ(data[0], 0xB4);
    else
      EXPECT_EQ(data[0], 76);
  }
  EXPECT_EQ(count, (std::array{0, 5, 10})) << "each by its own period";
}

/// From 50 ms on.
std::vector<Heard> spoilt(const char* subject, FaultKind kind, std::uint32_t id) {
  const MachineDescription machine = knuckle::test::broadcast_machine();
  return broadcasts_under(id, {}, machine, [&](CanNodes& nodes) {
    const auto number = frame_subject(subject, machine.bus);
    ASSERT_TRUE(number) << subject;
    const FrameSubject at = subject_at(*number, machine.bus).value();
    nodes.inject_broadcast(at.frame, broadcast_fault(kind), at.signals);
  });
}

TEST(Broadcasts, CanBeMadeWrongInEachWay) {
  constexpr std::uint32_t kFront = 0x18FF1021 | kExtendedId, kBody = 0x1A5;
  EXPECT_EQ(spoilt("front_angle", FaultKind::kFrameSilent, kFront).size(), 5U);
  const std::vector<Heard> frozen = spoilt("slope", FaultKind::kFrameFrozen, kBody);
  ASSERT_EQ(frozen.size(), 5U);
  EXPECT_EQ(frozen[4].frame, frozen[2].frame) << "counter and all";
  const std::vector<Heard> values = spoilt("body", FaultKind::kValuesFrozen, kBody);
  EXPECT_EQ(values[4].frame.data[2], 4) << "the counter goes on";
  EXPECT_EQ(values[4].frame.data[0], values[2].frame.data[0]);
  const std::vector<Heard> invalid = spoilt("arm_rod_pressure", FaultKind::kValuesInvalid, 0x18FF2021 | kExtendedId);
  EXPECT_EQ(invalid.back().frame.data, (std::array<std::uint8_t, 8>{76, 77, 0xFA, 0xFB, 76, 76, 0, 0}));
  const std::vector<Heard> spike = spoilt("boom_angle", FaultKind::kValuesSpike, kFront);
  EXPECT_EQ(spike[5].frame.data[1], 0x5F ^ 0x80);
  EXPECT_EQ(spike[6].frame, spike[4].frame);
  const std::vector<Heard> sum = spoilt("body", FaultKind::kFrameChecksum, kBody);
  const FrameClosing closing = knuckle::test::broadcast_machine().bus.broadcasts[2].closing;
  EXPECT_EQ(check_frame(closing, {}, sum[2].frame).fault, FrameFault::kNone);
  EXPECT_EQ(check_frame(closing, {}, sum[4].frame).fault, FrameFault::kChecksumWrong);
  EXPECT_EQ(spoilt("front_angle", FaultKind::kFrameShort, kFront).back().frame.size, 7);
}

}  // namespace
}  // namespace knuckle::sim::rig
