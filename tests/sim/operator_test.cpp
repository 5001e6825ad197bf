// The operator in front of a toy: a hand that is where it means to be, a machine that follows it with a lag, a spring.
#include "sim/operator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/sim/test_plant.h"
#include "tests/support/no_alloc.h"

namespace knuckle::sim {
namespace {

using namespace std::chrono_literals;

const JointVector kPose(0.7, -1.3, -0.7);
constexpr double kNowhere = std::numeric_limits<double>::infinity();

PlanarVector tip_of(const JointVector& q) {
  PlanarVector tip = PlanarVector::Zero();
  double angle = 0;
  for (int i = 0; i < kJoints; ++i) {
    angle += q[i];
    tip += test::solar().links[static_cast<std::size_t>(i)].length_m * PlanarVector(std::cos(angle), std::sin(angle));
  }
  return tip;
}

/// Hand, machine and modes in a few lines.
struct Toy {
  explicit Toy(std::vector<Phase> phases, Duration reaction = 200ms, std::vector<PathPoint> path = {},
               const JointVector& hand = kPose)
      : person(test::solar(), std::move(phases), std::move(path), 5ms, hand, reaction,
               PushStiffness{kFelt_N_per_m, kFelt_N_per_m}) {
    view.hand_rad = view.ghost_rad = hand;
    view.machine_rad = kPose;
    view.mode = Mode::kReady;
  }

  void step() {
    now += 1ms;
    const JointVector before = intent.joint_rad;
    const bool first = now == Time(1ms);
    const test::NoAllocScope scope;
    intent = person.step(now, view);
    EXPECT_EQ(scope.allocations(), 0U);
    EXPECT_TRUE(intent.joint_rad.allFinite());
    if (!first) largest_step_rad = std::max(largest_step_rad, (intent.joint_rad - before).cwiseAbs().maxCoeff());
    view.hand_rad = intent.joint_rad;
    if (intent.clutch) {
      offset_rad = view.ghost_rad - view.hand_rad;
    } else {
      view.ghost_rad = view.hand_rad + offset_rad;
    }
    if (modes_work) play_modes();
    if (view.mode == Mode::kEngaged && !stuck) view.machine_rad += 0.01 * (view.ghost_rad - view.machine_rad);
    const double deep_m = tip_of(view.ghost_rad).x() - wall_m;
    view.felt_N = PlanarVector(deep_m > 0 ? -kFelt_N_per_m * deep_m - intent.push_N.x() : 0, 0);
    if (-view.felt_N.x() > breaks_at_N) {
      ++view.breaks;
      wall_m = kNowhere;
    }
  }
  void play_modes() {
    const bool aligned = (view.ghost_rad - view.machine_rad).cwiseAbs().maxCoeff() < 0.087;
    if (view.mode == Mode::kReady && intent.enable && !held && aligned) view.mode = Mode::kEngaged;
    if (view.mode == Mode::kEngaged && !intent.enable) view.mode = Mode::kReady;
    if (view.mode == Mode::kFault && !intent.enable) view.mode = Mode::kReady;
    held = intent.enable;
  }
  /// @return seconds until the operator was done with `phases` phases; `longest_s` if it never was.
  double run(int phases, double longest_s = 60) {
    const Time start = now;
    while (person.phase() < phases && to_seconds(now - start) < longest_s) step();
    return to_seconds(now - start);
  }
  void run_for(double seconds) {
    for (int i = 0; i < static_cast<int>(1000 * seconds); ++i) step();
  }

  static constexpr double kFelt_N_per_m = 30;
  Operator person;
  OperatorView view;
  OperatorIntent intent;
  Time now{};
  JointVector offset_rad = JointVector::Zero();
  double wall_m = kNowhere, breaks_at_N = kNowhere, largest_step_rad = 0;
  bool held = false, stuck = false, modes_work = true;
};

Phase of_kind(PhaseKind kind) {
  Phase phase;
  phase.kind = kind;
  return phase;
}
Phase engage() {
  return of_kind(PhaseKind::kEngage);
}
Phase wait(double seconds) {
  Phase phase = of_kind(PhaseKind::kWait);
  phase.duration_s = seconds;
  return phase;
}
Phase sweep(double seconds) {
  Phase phase = of_kind(PhaseKind::kSweep);
  phase.joints_rad = JointVector(0.1, 0.2, 0.3);
  phase.periods_s = JointVector(4, 3, 2.5);
  phase.duration_s = seconds;
  return phase;
}
Phase wander(double seconds) {
  Phase phase = of_kind(PhaseKind::kWander);
  phase.speed_mps = 0.6;
  phase.duration_s = seconds;
  phase.timeout_s = seconds + 30;
  return phase;
}
Phase move_by(const PlanarVector& way_m, double speed_mps = 0.3) {
  Phase phase = of_kind(PhaseKind::kMove);
  phase.tip_m = tip_of(kPose) + way_m;
  phase.bucket_rad = kPose.sum();
  phase.speed_mps = speed_mps;
  phase.tolerance_m = 0.02;
  return phase;
}
Phase move_to(const JointVector& joints_rad) {
  Phase phase = of_kind(PhaseKind::kMove);
  phase.joint_space = true;
  phase.joints_rad = joints_rad;
  phase.speed_mps = 0.4;
  return phase;
}
Phase press(double force_N, double hold_s) {
  Phase phase = of_kind(PhaseKind::kPress);
  phase.speed_mps = 0.1;
  phase.force_N = force_N;
  phase.duration_s = hold_s;
  return phase;
}
Phase clutch(const JointVector& hand_rad) {
  Phase phase = of_kind(PhaseKind::kClutch);
  phase.joints_rad = hand_rad;
  return phase;
}

TEST(Operator, EngagesByAligningFirstAndPressingEnableThen) {
  Toy toy({engage()}, 200ms, {}, kPose + JointVector(0.2, -0.1, 0.3));
  while (toy.person.phase() == 0 && toy.now < Time(20s)) {
    const bool before = toy.intent.enable;
    toy.step();
    if (toy.intent.enable && !before) {
      EXPECT_LT((toy.view.ghost_rad - toy.view.machine_rad).cwiseAbs().maxCoeff(), 0.087) << "pressed while misaligned";
    }
  }
  EXPECT_TRUE(toy.person.finished());
  EXPECT_EQ(toy.view.mode, Mode::kEngaged);
  EXPECT_TRUE(toy.intent.presence && toy.intent.enable);
  EXPECT_LT(toy.largest_step_rad, 0.001) << "aligned at no more than 0.6 rad/s";
}

TEST(Operator, PressesNothingBeforeTheMachineIsShown) {
  for (const Mode mode : {Mode::kOff, Mode::kSelfTest}) {
    Toy toy({engage()}, 200ms, {}, kPose + JointVector(0.2, 0, 0));
    toy.view.mode = mode;
    toy.run_for(3);
    EXPECT_FALSE(toy.intent.enable);
    EXPECT_EQ(toy.largest_step_rad, 0);
  }
}

TEST(Operator, LetsGoOfEnableBeforeItPressesAgainAfterAFault) {
  Toy toy({engage(), wait(1), engage()});
  toy.run(2);
  ASSERT_TRUE(toy.intent.enable);
  toy.view.mode = Mode::kFault;
  bool released = false;
  while (!toy.person.finished() && toy.now < Time(20s)) {
    toy.step();
    released = released || !toy.intent.enable;
    if (toy.view.mode == Mode::kEngaged) {
      EXPECT_TRUE(released);
    }
  }
  EXPECT_TRUE(toy.person.finished());
  EXPECT_TRUE(released);
}

TEST(Operator, TriesEnableAgainWhenNothingComesOfIt) {
  Toy toy({engage()});
  toy.modes_work = false;
  int presses = 0, releases = 0;
  for (int i = 0; i < 8000; ++i) {
    const bool before = toy.intent.enable;
    toy.step();
    presses += !before && toy.intent.enable;
    releases += before && !toy.intent.enable;
  }
  EXPECT_GE(presses, 3);
  EXPECT_GE(releases, presses - 1);
  EXPECT_EQ(toy.person.phase(), 0);
}

TEST(Operator, MovesTheTipAlongAStraightLineWithinItsSpeed) {
  const PlanarVector way(0.3, -0.4);
  Toy toy({engage(), move_by(way, 0.25)});
  toy.run(1);
  const PlanarVector from = tip_of(toy.view.ghost_rad), along = way.normalized();
  double fastest_mps = 0, off_line_m = 0;
  PlanarVector last = from;
  while (!toy.person.finished() && toy.now < Time(30s)) {
    toy.step();
    const PlanarVector tip = tip_of(toy.view.ghost_rad);
    fastest_mps = std::max(fastest_mps, (tip - last).norm() * 1e3);
    off_line_m = std::max(off_line_m, std::abs((tip - from).x() * along.y() - (tip - from).y() * along.x()));
    last = tip;
  }
  EXPECT_LT((tip_of(toy.view.machine_rad) - (tip_of(kPose) + way)).norm(), 0.02);
  EXPECT_NEAR(fastest_mps, 0.25, 0.025);
  EXPECT_LT(off_line_m, 0.005);
  EXPECT_NEAR(toy.view.ghost_rad.sum(), kPose.sum(), 0.01) << "the bucket keeps its angle";
}

TEST(Operator, WaitsForTheMachineAndGivesUpAtTheTimeOut) {
  Phase move = move_by({0.3, 0});
  move.timeout_s = 6;
  Toy toy({engage(), move, wait(1)});
  toy.run(1);
  toy.stuck = true;
  EXPECT_NEAR(toy.run(2), 6, 0.01);
  EXPECT_EQ(toy.person.timed_out(), 1);
  toy.run(3);
  EXPECT_TRUE(toy.person.finished());
  EXPECT_EQ(toy.person.timed_out(), 1) << "the first one is told";
}

TEST(Operator, PressesWithTheForceAskedForAndHoldsStill) {
  for (const double force_N : {0.8, 2.0, 5.0}) {
    Phase phase = press(force_N, 4);
    phase.speed_mps = 0.04;  // gentle enough not to have overshot before it is felt
    Toy toy({engage(), phase});
    toy.wall_m = tip_of(kPose).x() + 0.05;
    toy.run(1);
    while (!toy.person.holding() && toy.now < Time(20s)) toy.step();
    ASSERT_TRUE(toy.person.holding());
    toy.run_for(0.5);
    EXPECT_NEAR(-toy.view.felt_N.x(), force_N, 0.15 * force_N);
    EXPECT_GT(toy.intent.push_N.x(), 0.2 * force_N) << "with its muscles, from where it has touched";
    const JointVector held = toy.intent.joint_rad;
    toy.run_for(3.3);
    EXPECT_EQ(toy.intent.joint_rad, held) << "a hold is a hand that does not move";
    EXPECT_TRUE(toy.person.holding());
    EXPECT_LT(toy.run(2), 0.3);
    EXPECT_FALSE(toy.person.holding());
    toy.run_for(1);
    EXPECT_LT(toy.intent.push_N.norm(), 1e-3 * force_N) << "and relaxes them afterwards";
  }
}

TEST(Operator, PushesHarderUntilItSeesSomethingGiveWay) {
  Phase phase = press(2, 0);
  phase.until_break = true;
  const Duration reaction = 300ms;
  Toy toy({engage(), phase}, reaction);
  toy.wall_m = tip_of(kPose).x() + 0.05;
  toy.breaks_at_N = 3.5;  // more than it pushes with at first
  toy.run(1);
  while (toy.view.breaks == 0 && toy.now < Time(40s)) toy.step();
  ASSERT_EQ(toy.view.breaks, 1);
  EXPECT_EQ(toy.person.phase(), 1);
  EXPECT_NEAR(toy.run(2), to_seconds(reaction), 0.02) << "seen late";
  EXPECT_EQ(toy.person.timed_out(), -1);
}

TEST(Operator, GoesOnUntilTheMachineHasStoppedWhereAskedTo) {
  for (Phase phase : {sweep(3), wait(3)}) {
    phase.until_fault = true;
    phase.timeout_s = 20;
    Toy toy({engage(), phase});
    toy.run(1);
    toy.run_for(8);
    EXPECT_EQ(toy.person.phase(), 1) << "its length alone does not end it";
    toy.modes_work = false;
    toy.view.mode = Mode::kEStop;
    EXPECT_NEAR(toy.run(2), 0.2, 0.02);
    EXPECT_EQ(toy.person.timed_out(), -1);
  }
  Phase phase = wait(3);
  phase.until_fault = true;
  phase.timeout_s = 5;
  Toy toy({engage(), phase});
  toy.run(2);
  EXPECT_EQ(toy.person.timed_out(), 1) << "a fault that was meant to come and did not";
}

TEST(Operator, FollowsARecordingFromItsStartToItsEnd) {
  std::vector<PathPoint> path;
  for (int i = 0; i <= 1000; ++i) {
    const double t = i / 200.0;
    path.push_back(
        {kPose + JointVector(0.1 + 0.05 * std::sin(t), -0.2 + 0.1 * std::sin(t), 0.3 - 0.05 * t), JointVector::Zero()});
  }
  Toy toy({engage(), of_kind(PhaseKind::kPath)}, 200ms, path);
  toy.run(1);
  double furthest = 0;
  const Time start = toy.now;
  const double to_start_s = 1.875 * 0.3 / 0.25;
  while (!toy.person.finished() && toy.now < Time(60s)) {
    toy.step();
    const double t = to_seconds(toy.now - start) - 1e-3 - to_start_s;
    if (t < 0 || t >= 5) continue;
    furthest = std::max(
        furthest, (toy.view.ghost_rad - path[static_cast<std::size_t>(t * 200)].joints_rad).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(furthest, 0.002);
  EXPECT_LT((toy.view.ghost_rad - path.back().joints_rad).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Operator, ClutchMovesTheHandAndNotTheMachine) {
  const JointVector way(0.3, -0.2, 0.1);
  Toy toy({engage(), clutch(way), wait(2)});
  toy.run(1);
  const JointVector hand = toy.view.hand_rad, machine = toy.view.ghost_rad;
  toy.run(2);
  EXPECT_FALSE(toy.intent.clutch);
  EXPECT_LT((toy.view.hand_rad - hand - way).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((toy.view.ghost_rad - machine).cwiseAbs().maxCoeff(), 1e-9) << "hand moved only while the clutch was held";
  toy.run(3);
  EXPECT_LT((toy.view.ghost_rad - machine).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Operator, IntentIsContinuousAcrossAllPhases) {
  std::vector<PathPoint> path(400, {kPose + JointVector(-0.1, 0.2, 0.1), JointVector::Zero()});
  Toy toy({engage(), sweep(6), move_by({0.1, 0.1}), press(2, 1), clutch(JointVector(0.2, 0.1, 0)), wait(0.5),
           move_to(kPose + JointVector(0.1, 0, 0)), of_kind(PhaseKind::kPath), move_by({-0.1, 0.2}), sweep(4)},
          200ms, path, kPose + JointVector(0.1, 0.1, 0.1));
  toy.wall_m = tip_of(kPose).x() + 0.15;
  while (!toy.person.finished() && toy.now < Time(120s)) {
    const int phase = toy.person.phase();
    toy.largest_step_rad = 0;
    toy.step();
    ASSERT_LT(toy.largest_step_rad, 0.0015) << "in phase " << phase << " at " << to_seconds(toy.now) << " s";
    ASSERT_LT(toy.intent.rate_radps.cwiseAbs().maxCoeff(), 1.5);
  }
  EXPECT_TRUE(toy.person.finished());
  EXPECT_EQ(toy.person.timed_out(), -1);
}

TEST(Operator, StaysWithinTheMachinesReachWhateverIsAskedAndGivesUpAPressThatTouchesNothing) {
  Phase push = press(2, 1);  // nothing there: the hand goes on until the arm is straight
  push.speed_mps = 0.5;
  push.timeout_s = 10;
  Toy toy({engage(), push, sweep(1)});
  const MachineDescription& machine = test::solar();
  while (toy.person.phase() < 2 && toy.now < Time(30s)) {
    toy.step();
    for (std::size_t i = 0; i < kJoints; ++i) {
      ASSERT_GE(toy.view.ghost_rad[static_cast<Eigen::Index>(i)], machine.links[i].min_rad - 1e-9);
      ASSERT_LE(toy.view.ghost_rad[static_cast<Eigen::Index>(i)], machine.links[i].max_rad + 1e-9);
    }
  }
  EXPECT_EQ(toy.person.timed_out(), 1);
  EXPECT_FALSE(toy.person.holding());
}

TEST(Operator, WandersToAllEndsWithinItsSpeedAndComesToRest) {
  Toy toy({engage(), wander(300), wait(1)});
  toy.run(1);
  JointVector low = toy.view.ghost_rad, high = low, last = low;
  double fastest_radps = 0;
  while (toy.person.phase() == 1) {
    toy.step();
    low = low.cwiseMin(toy.view.ghost_rad);
    high = high.cwiseMax(toy.view.ghost_rad);
    fastest_radps = std::max(fastest_radps, (toy.view.ghost_rad - last).cwiseAbs().maxCoeff() / 1e-3);
    last = toy.view.ghost_rad;
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto j = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(low[j], test::solar().links[i].min_rad, 1e-9) << i;
    EXPECT_NEAR(high[j], test::solar().links[i].max_rad, 1e-9) << i;
  }
  EXPECT_GT(fastest_radps, 0.3);
  EXPECT_LT(fastest_radps, 0.61);
  const JointVector end = toy.view.ghost_rad;
  toy.run_for(0.5);
  EXPECT_NEAR((toy.view.ghost_rad - end).norm(), 0, 1e-3) << "nothing was left on its way";
}

}  // namespace
}  // namespace knuckle::sim
