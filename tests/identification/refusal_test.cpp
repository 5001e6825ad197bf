// What `full` refuses, and what it says then.
#include <gtest/gtest.h>

#include <array>

#include "estimation/identification/full.h"
#include "tests/identification/synthetic.h"

namespace knuckle::estimation {
namespace {

/// Stands still in `poses` poses, so long in each; a gap between them.
Recording poses(const MachineDescription& machine, int count, double each_s, bool same) {
  SyntheticMachine twin(machine, {});
  Recording recording{"poses", 0.01, {}, {}, {}};
  for (int k = 0; k < count; ++k) {
    SineMotion::Point p = RichMotion().at(same ? 0 : 3.7 * k);
    p.rate = p.acceleration = JointVector::Zero();
    for (double t = 0; t < each_s; t += 0.01) {
      recording.samples.push_back(twin.measure(p, JointVector::Zero()));
      recording.usable.push_back(1);
    }
    recording.usable.back() = 0;
  }
  return recording;
}

class Refusal : public ::testing::Test {
 protected:
  MachineDescription machine_ = plain_machine();
  void expect(const Recording& recording, const std::string& words) const {
    const FullResult result = identify_full(machine_, std::array{recording});
    EXPECT_FALSE(result.summary.usable);
    std::string all;
    for (const std::string& reason : result.summary.reasons) all += reason + "\n";
    EXPECT_NE(all.find(words), std::string::npos) << all;
    EXPECT_EQ(all.find("not run"), std::string::npos);
  }
};

TEST_F(Refusal, OfThreeSecondsOfData) {
  expect(recorded(machine_, RichMotion(), 3, 0.01), "2.8 s of usable data, at least 20.0 s are needed");
}

TEST_F(Refusal, OfNoDataAtAll) {
  EXPECT_FALSE(identify_full(machine_, {}).summary.usable);
  expect(Recording{"empty", 0.01, {}, {}, {}}, "0.0 s of usable data");
}

TEST_F(Refusal, OfPressuresThatAreAllZero) {
  Recording recording = recorded(machine_, RichMotion(), 30, 0.01);
  for (Measurement& m : recording.samples) m.pressure_Pa.fill(0);
  expect(recording, "all pressures are below 1 bar throughout");
}

TEST_F(Refusal, OfOneConstantPressure) {
  Recording recording = recorded(machine_, RichMotion(), 30, 0.01);
  for (Measurement& m : recording.samples) m.pressure_Pa[2] = 42e5;
  expect(recording, "arm head pressure never changes: 42.0 bar");
}

TEST_F(Refusal, OfAConstantEncoder) {
  Recording recording = recorded(machine_, RichMotion(), 30, 0.01);
  for (Measurement& m : recording.samples) m.cylinder_m[kBucket] = recording.samples[0].cylinder_m[kBucket];
  expect(recording, "bucket moves over 0.0 deg only");
}

TEST_F(Refusal, OfTenIdenticalPoses) {
  expect(poses(machine_, 10, 3, true), "boom moves over 0.0 deg only");
}

TEST_F(Refusal, OfMotionInOneDirectionOnly) {
  struct OneWay {
    [[nodiscard]] static SineMotion::Point at(double t) {
      SineMotion::Point p = RichMotion().at(t);
      p.angle[kBoom] = -0.2 + 0.02 * t;
      p.rate[kBoom] = 0.02;
      p.acceleration[kBoom] = 0;
      return p;
    }
  };
  expect(recorded(machine_, OneWay{}, 30, 0.01), "boom cylinder retracts for 0.0 s only");
}

TEST_F(Refusal, OfPosesAtRestWhichDoNotShowInertia) {
  const FullResult result = identify_full(machine_, std::array{poses(machine_, 30, 1, false)});
  EXPECT_FALSE(result.summary.usable);
  std::string all;
  for (const std::string& line : result.summary.indistinct) all += line + "\n";
  EXPECT_NE(all.find("J1 does not show in the data"), std::string::npos) << all;
}

TEST_F(Refusal, OfAChannelWithTheWrongSign) {
  Recording recording = recorded(machine_, RichMotion(), 30, 0.01);
  for (Measurement& m : recording.samples) std::swap(m.pressure_Pa[2], m.pressure_Pa[5]);
  expect(recording, "the model explains only");
}

}  // namespace
}  // namespace knuckle::estimation
