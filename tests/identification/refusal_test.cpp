// What `full` refuses, and what it says then.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "estimation/identification/full.h"
#include "tests/identification/synthetic.h"
#include "tests/support/lines.h"
#include "tests/support/says.h"

namespace knuckle::estimation {
namespace {

/// Stands still in `poses` poses, so long in each; a gap between them.
Recording poses(const MachineDescription& machine, int count, double each_s) {
  SyntheticMachine twin(machine, {});
  Recording recording{"poses", 0.01, {}, {}, {}};
  for (int k = 0; k < count; ++k) {
    SineMotion::Point p = RichMotion().at(3.7 * k);
    p.rate = p.acceleration = JointVector::Zero();
    for (double t = 0; t < each_s; t += 0.01) {
      recording.samples.push_back(twin.measure(p, JointVector::Zero()));
      recording.usable.push_back(1);
    }
    recording.usable.back() = 0;
  }
  return recording;
}

FullResult result_of(const std::vector<Recording>& recordings) {
  const FullResult result = identify_full(plain_machine(), recordings);
  EXPECT_FALSE(result.summary.usable);
  return result;
}

/// 30 s, every sample of it spoilt.
Recording spoilt(const std::function<void(Measurement&)>& spoil) {
  Recording recording = recorded(plain_machine(), RichMotion(), 30, 0.01);
  std::for_each(recording.samples.begin(), recording.samples.end(), spoil);
  return recording;
}

struct OneWay {
  [[nodiscard]] static SineMotion::Point at(double t) {
    SineMotion::Point p = RichMotion().at(t);
    p.angle[kBoom] = -0.2 + 0.02 * t;
    p.rate[kBoom] = 0.02;
    p.acceleration[kBoom] = 0;
    return p;
  }
};

TEST(Refusal, OfDataThatCannotTellSaysWhatIsMissing) {
  const MachineDescription machine = plain_machine();
  const double length_m = recorded(machine, RichMotion(), 1, 0.01).samples[0].cylinder_m[kBucket];
  for (const auto& [recording, words] : {
           std::pair{recorded(machine, RichMotion(), 3, 0.01), "2.8 s of usable data, at least 20.0 s are needed"},
           {Recording{"empty", 0.01, {}, {}, {}}, "0.0 s of usable data"},
           {spoilt([](Measurement& m) { m.pressure_Pa.fill(0); }), "all pressures are below 1 bar throughout"},
           {spoilt([](Measurement& m) { m.pressure_Pa[2] = 42e5; }), "arm head pressure never changes: 42.0 bar"},
           {spoilt([=](Measurement& m) { m.cylinder_m[kBucket] = length_m; }), "bucket moves over 0.0 deg only"},
           {recorded(machine, OneWay{}, 30, 0.01), "boom cylinder retracts for 0.0 s only"},
           {spoilt([](Measurement& m) { std::swap(m.pressure_Pa[2], m.pressure_Pa[5]); }), "the model explains only"},
       }) {
    const std::string all = test::lines_of(result_of({recording}).summary.reasons);
    EXPECT_TRUE(test::says(all, words));
    EXPECT_FALSE(test::says(all, "not run"));
  }
  EXPECT_FALSE(result_of({}).summary.usable);
}

TEST(Refusal, OfPosesAtRestWhichDoNotShowInertia) {
  EXPECT_TRUE(test::says(test::lines_of(result_of({poses(plain_machine(), 30, 1)}).summary.indistinct),
                         "J1 does not show in the data"));
}

}  // namespace
}  // namespace knuckle::estimation
