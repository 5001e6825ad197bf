// Both ends of the wave variables with the line between them.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "machine/kinematics.h"
#include "master/wave_law.h"
#include "slave/wave_port.h"
#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

constexpr double kStep_s = 1e-3;

template <typename T>
class Line {
 public:
  explicit Line(int delay_steps) : ring_(static_cast<std::size_t>(delay_steps) + 1) {}
  T step(const T& in) {
    ring_[at_] = in;
    at_ = (at_ + 1) % ring_.size();
    return ring_[at_];
  }

 private:
  std::vector<T> ring_;
  std::size_t at_ = 0;
};

/// A hand that moves as it likes, a lossless line of constant delay, and an arm that follows its set-point at once and
/// presses into a spring and a damper: all of it passive but the hand, so that whatever the hand gets back was put in.
struct Waves {
  struct Up {
    Time sent_at{};
    MasterMessage message;
  };
  struct Down {
    Time sent_at{};
    Wave wave;
  };
  explicit Waves(int delay_ms)
      : machine(load_machine(find_config("machine", "solar015"))),
        kinematics(machine),
        port(machine, kStep_s),
        up(delay_ms),
        down(delay_ms),
        start_rad(0.3, -1.4, -0.6) {
    reference_rad = start_rad;
    last_m = kinematics.tip(start_rad);
  }

  void step(const PlanarVector& hand_mps) {
    now += 1ms;
    master::FeltInputs in;
    in.engaged = true;
    in.now = now;
    in.hand_mps = hand_mps;
    in.force_scale = 1e-3;
    in.position_scale = 10;
    in.returned_at = came.sent_at;
    in.returned = came.wave;
    felt_N = law.step(in, kStep_s);
    // In machine units: what the hand puts in.
    from_hand_J -= felt_N.dot(hand_mps) * in.position_scale / in.force_scale * kStep_s;

    MasterMessage message;
    message.stamp.sent_at = now;
    message.wave_Ns_per_m = law.impedance_Ns_per_m();
    message.wave = law.leaving();
    const MasterMessage arrived = up.step({now, message}).message;
    const bool led = arrived.wave_Ns_per_m > 0;
    const PlanarVector tip_m = kinematics.tip(reference_rad), before_m = last_m;
    tip_mps = (tip_m - before_m) / kStep_s;
    last_m = tip_m;
    world_N = -stiffness_N_per_m * (tip_m - kinematics.tip(start_rad)) - damping_Ns_per_m * tip_mps;
    const auto followed =
        port.step({drifts ? start_rad : reference_rad, JointVector::Zero()}, arrived, reference_rad, world_N, led, now);
    const Eigen::Matrix<double, 2, 3> jacobian = kinematics.tip_jacobian(reference_rad);
    if (led) {
      to_world_J -= world_N.dot(jacobian * followed.velocity_radps) * kStep_s;
      reference_rad = followed.position_rad;
    }
    came = down.step({now, port.returning()});
  }

  MachineDescription machine;
  Kinematics kinematics;
  master::WaveLaw law{1e6};
  slave::WavePort port;
  Line<Up> up;
  Line<Down> down;
  JointVector start_rad, reference_rad;
  Time now{};
  Down came;
  PlanarVector felt_N = PlanarVector::Zero(), world_N = PlanarVector::Zero(), tip_mps = PlanarVector::Zero();
  PlanarVector last_m = PlanarVector::Zero();
  double stiffness_N_per_m = 2e4, damping_Ns_per_m = 500;
  bool drifts = true;  // the operator is taken to ask for the start all the time
  double from_hand_J = 0, to_world_J = 0;
};

PlanarVector some_speed(std::mt19937_64& random, double t) {
  std::normal_distribution<double> noise;
  return PlanarVector(0.02 * std::sin(3 * t) + 0.03 * std::sin(11 * t), 0.03 * std::cos(5 * t)) +
         0.01 * PlanarVector(noise(random), noise(random));
}

TEST(Waves, NeverGiveMoreThanWasPutInOverALosslessConstantDelay) {
  for (const int delay_ms : {1, 25, 100, 200}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      std::mt19937_64 random(seed);
      Waves waves(delay_ms);
      waves.stiffness_N_per_m = 1e4 * double(seed);
      for (int i = 0; i < 10'000; ++i) {
        waves.step(some_speed(random, i * kStep_s));
        ASSERT_GE(waves.from_hand_J - waves.to_world_J, -1e-6 * std::abs(waves.from_hand_J) - 1e-9)
            << "delay " << delay_ms << " ms, seed " << seed << ", step " << i;
      }
      EXPECT_GT(waves.from_hand_J, 1) << "delay " << delay_ms;
    }
  }
}

TEST(Waves, HoldTheHandWithTheForceOfTheMachine) {
  Waves waves(25);
  waves.drifts = false;
  for (int i = 0; i < 30'000; ++i) waves.step(i < 400 ? PlanarVector(0.01, 0.01) : PlanarVector::Zero());
  ASSERT_GT(waves.world_N.norm(), 50);
  EXPECT_NEAR((waves.felt_N - 1e-3 * waves.world_N).norm(), 0, 0.05 * 1e-3 * waves.world_N.norm() + 0.01);
}

TEST(Waves, LeadNoFurtherFromWhatTheOperatorAsksThanASetPointMayBeWrongBy) {
  Waves waves(25);
  waves.stiffness_N_per_m = waves.damping_Ns_per_m = 0;
  double furthest_rad = 0;
  for (int i = 0; i < 3000; ++i) {
    waves.step(PlanarVector(0.05, 0));  // the hand says go on, the set-point stays
    furthest_rad = std::max(furthest_rad, (waves.reference_rad - waves.start_rad).cwiseAbs().maxCoeff());
  }
  EXPECT_LE(furthest_rad, 0.0873 + 1e-9);
  EXPECT_GT(furthest_rad, 0.05);
}

/// A wall that holds the arm with 2 kN from the start on, a set-point that goes on behind it, and a hand that puts no
/// wave in, as while the law gives way to cues.
struct Blocked {
  void step(const JointVector& asked_radps) {
    now += 1ms;
    asked.velocity_radps = asked_radps;
    asked.position_rad += kStep_s * asked_radps;
    MasterMessage message;
    message.stamp.sent_at = now;
    message.wave_Ns_per_m = 2000;
    const double in_m = (kinematics.tip(reference_rad) - kinematics.tip(start_rad)).dot(into_wall);
    const PlanarVector world_N = -std::max(0.0, 2000 + 1e4 * in_m) * into_wall;
    const Eigen::Matrix<double, 2, 3> jacobian = kinematics.tip_jacobian(reference_rad);
    const auto followed = port.step(asked, message, reference_rad, world_N, true, now);
    to_world_J -= world_N.dot(jacobian * followed.velocity_radps) * kStep_s;
    reference_rad = followed.position_rad;
  }

  MachineDescription machine = load_machine(find_config("machine", "solar015"));
  Kinematics kinematics{machine};
  slave::WavePort port{machine, kStep_s};
  JointVector start_rad{0.3, -1.4, -0.6}, reference_rad = start_rad;
  PlanarVector into_wall{1, 0};
  slave::WavePort::Reference asked{start_rad, JointVector::Zero()};
  Time now{};
  double to_world_J = 0;
};

TEST(Waves, DoNoWorkOnAWallThatHoldsBackAHandWithoutAWave) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int draw = 0; draw < 50; ++draw) {
    Blocked blocked;
    const double way = std::numbers::pi * uniform(random);
    blocked.into_wall = PlanarVector(std::cos(way), std::sin(way));
    const JointVector asked_radps = 0.12 * JointVector(uniform(random), uniform(random), uniform(random));
    double most_J = 0, least_J = 0;
    for (int i = 0; i < 4000; ++i) {
      blocked.step(asked_radps);
      most_J = std::max(most_J, blocked.to_world_J);
      least_J = std::min(least_J, blocked.port.kept_J());
    }
    EXPECT_LE(most_J, 1e-9) << "draw " << draw;
    EXPECT_GE(least_J, -1e-9) << "draw " << draw;
  }
}

session::SessionSetup pressed_with(ControlLaw law, Duration one_way) {
  session::SessionSetup setup = session_setup("wall_contact", 1);
  setup.law = law;
  setup.to_machine.delay = setup.to_operator.delay = one_way;
  return setup;
}

class EveryLaw : public testing::TestWithParam<const char*> {};

TEST_P(EveryLaw, RunsAWholeSessionWithinItsSlewAndWithoutAFault) {
  const FinishedSession session = run_session(pressed_with(*control_law_named(GetParam()), 25ms));
  EXPECT_EQ(session.allocations, 0u);
  EXPECT_TRUE(session.record.faults.empty());
  EXPECT_LE(session.metrics.max_slew_N_per_ms.value_or(1e9), 0.5);
  EXPECT_TRUE(session.record.warnings.empty());
}
INSTANTIATE_TEST_SUITE_P(Laws, EveryLaw, testing::ValuesIn(kControlLawNames),
                         [](const auto& chosen) { return std::string(chosen.param); });

}  // namespace
}  // namespace knuckle::test
