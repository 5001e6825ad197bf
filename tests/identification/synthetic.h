// Recordings of a machine that is exactly the regressor model and follows a prescribed motion: every error in them is
// one that a test has put in.
#pragma once

#include <cmath>

#include "estimation/identification/recording.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {

/// A sum of three incommensurable sines a joint, to about 0.1 m/s at the cylinders for `pace` 1.
class RichMotion {
 public:
  explicit RichMotion(double pace = 1) : pace_(pace) {}
  [[nodiscard]] SineMotion::Point at(double t) const {
    SineMotion::Point p{JointVector(0.3, -1.5, -0.9), JointVector::Zero(), JointVector::Zero()};
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < kJoints; ++j) {
        const double w = pace_ * (0.31 + 0.17 * j + 0.73 * k + 0.11 * j * k), phase = 1.3 * j + 2.1 * k;
        const double a = (j == kBucket ? 0.5 : 0.3) / (1 + k);
        p.angle[j] += a * std::sin(w * t + phase);
        p.rate[j] += a * w * std::cos(w * t + phase);
        p.acceleration[j] -= a * w * w * std::sin(w * t + phase);
      }
    }
    return p;
  }

 private:
  double pace_;
};

/// More on the rod side, and as much on the head side as leaves the force alone: the twin's rod side is constant.
inline void squeeze(const MachineDescription& machine, double rod_Pa, Measurement& m) {
  for (std::size_t k = 0; k < kJoints; ++k) {
    m.pressure_Pa[2 * k + 1] += rod_Pa;
    m.pressure_Pa[2 * k] += rod_Pa * machine.cylinders[k].rod_side_area_m2() / machine.cylinders[k].head_area_m2();
  }
}

template <typename MotionType>
Recording recorded(const MachineDescription& machine, const MotionType& motion, double duration_s, double step_s,
                   const SyntheticErrors& errors = {}) {
  SyntheticMachine twin(machine, errors);
  Recording recording{"synthetic", step_s, {}, {}, {}};
  const auto count = static_cast<std::size_t>(std::lround(duration_s / step_s));
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) * step_s;
    recording.samples.push_back(twin.measure(motion.at(t), JointVector::Zero()));
    squeeze(machine, 5e5 * std::sin(t), recording.samples.back());
    recording.usable.push_back(1);
  }
  return recording;
}

/// test_machine() without a Stribeck part, as its curve has another v_s than the method's.
inline MachineDescription plain_machine() {
  MachineDescription machine = test_machine();
  for (CylinderDescription& cylinder : machine.cylinders) cylinder.friction.static_ratio = 1;
  return machine;
}

}  // namespace knuckle::estimation
