// The plant's step against Runge and Kutta's with steps so small that they err no more.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "machine/kinematics.h"
#include "sim/plant.h"
#include "sim/plant_model.h"
#include "test_plant.h"

namespace knuckle::sim {
namespace {

struct Case {
  const char* name;
  JointVector opening;
  double bound_m;           ///< At the tip after a second of millisecond steps.
  double left_share = 0.2;  ///< What halving the half-millisecond step leaves of the error, at most.
  bool compliant = false;   ///< Pins; those are never stepped by whole milliseconds.
};

StateVector runge_kutta(PlantModel& model, const HeldInputs& held, const WorldModel& world, StateVector x,
                        double seconds, double h = 0.03125e-3) {
  PlantDetail detail;
  for (int i = 0; i < static_cast<int>(seconds / h + 0.5); ++i) {
    const StateVector k1 = model.derivative(x, held, world, detail);
    const StateVector k2 = model.derivative(x + h / 2 * k1, held, world, detail);
    const StateVector k3 = model.derivative(x + h / 2 * k2, held, world, detail);
    const StateVector k4 = model.derivative(x + h * k3, held, world, detail);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return x;
}

StateVector stepped(PlantModel& model, const HeldInputs& held, const WorldModel& world, StateVector x, double seconds,
                    double h) {
  PlantDetail detail;
  StateVector slope = model.derivative(x, held, world, detail);
  for (int i = 0; i < static_cast<int>(seconds / h + 0.5); ++i) {
    x = model.stepped(x, slope, detail, held, world, h);
    slope = model.derivative(x, held, world, detail, PlantModel::Geometry::kNear);  // as the plant does
  }
  return x;
}

class PlantStep : public testing::TestWithParam<Case> {};

TEST_P(PlantStep, IsCloseToTheReference) {
  MachineTruth truth = nominal_truth(test::solar());
  if (GetParam().compliant) {
    for (PinTruth& pin : truth.pin) pin = compliant_pin(30e6, 0, 15);
  }
  PlantModel model(truth);
  const WorldModel free({}, test::solar());
  HeldInputs held;
  for (int i = 0; i < kJoints; ++i) held.opening[static_cast<std::size_t>(i)] = GetParam().opening[i];
  const StateVector start = model.equilibrium(kWorkingPose, {});
  const auto tip = [&](const StateVector& x) { return RigidBody::tip(model.body().pose(x.segment<3>(kAngle))); };
  const PlanarVector reference = tip(runge_kutta(model, held, free, start, 1));
  const auto error = [&](double h) { return (tip(stepped(model, held, free, start, 1, h)) - reference).norm(); };
  const double half = error(0.5e-3), quarter = error(0.25e-3);
  RecordProperty("error_nm_at_half_ms", static_cast<int>(1e9 * half));
  RecordProperty("error_nm_at_quarter_ms", static_cast<int>(1e9 * quarter));
  if (!GetParam().compliant) {
    EXPECT_LT(error(1e-3), GetParam().bound_m);
  }
  EXPECT_LT(half, 2e-5);
  EXPECT_LT(quarter, GetParam().left_share * half + 2e-8);
}

TEST(PlantStepReuse, OfADerivativeWhereOnlyValvesMovedChangesNothing) {
  // Oil that warms by next to nothing: the same numbers, but every derivative is taken anew.
  using namespace std::chrono_literals;
  const auto make = [](double warming_K) {
    MachineTruth truth = nominal_truth(test::solar());
    truth.warm_up.rise_K = warming_K;
    WorldDescription world;
    const MachinePose pose = pose_of(truth.machine, kWorkingPose);
    PlanarVector foremost = pose.bucket_pin_m;
    for (const PlanarVector& corner : bucket_outline(truth.machine)) {
      if (const PlanarVector at = pose.bucket * corner; at.x() > foremost.x()) foremost = at;
    }
    WallDescription wall{.point_m = foremost + PlanarVector(0.05, 0), .normal = {-1, 0}};
    wall.break_force_N = 4000;
    wall.break_impulse_Ns = 100;
    wall.piece_mass_kg = 40;
    wall.piece_depth_m = 0.2;
    wall.piece_rest_m = wall.point_m - PlanarVector(0.3, 0.8);
    world.walls.push_back(wall);
    Plant plant(truth, world, kWorkingPose);
    plant.set_pilot(true);
    return plant;
  };
  Plant reusing = make(0), anew = make(1e-30);
  bool broke = false;
  for (int i = 0; i < 9000; ++i) {
    for (Plant* plant : {&reusing, &anew}) {
      demand(*plant,
             i < 4000 ? JointVector(0.1, -0.7, 0.1) : 0.5 * JointVector(std::sin(i * 1e-3), std::cos(i * 1e-3), 1));
      if (i == 5000) plant->hang(60);
      if (i == 6000) plant->hang(0);
      plant->set_pull(i > 7000 && i < 7500 ? PlanarVector(-300, 500) : PlanarVector(0, 0));
      plant->step(1ms);
    }
    const PlantState &a = reusing.state(), &b = anew.state();
    ASSERT_EQ(a.joint_rad, b.joint_rad) << "at " << i << " ms";
    ASSERT_EQ(a.chamber_Pa, b.chamber_Pa) << "at " << i << " ms";
    ASSERT_EQ(a.energy.links.out, b.energy.links.out) << "at " << i << " ms";
    if (a.events.count > 0) broke |= a.events.at(a.events.count - 1).kind == WorldEventKind::kPieceBroke;
  }
  EXPECT_TRUE(broke) << "or a wall that breaks was not tried";
}

INSTANTIATE_TEST_SUITE_P(Cases, PlantStep,
                         testing::Values(Case{"mixed", {0.3, -0.2, 0.25}, 1e-6},
                                         Case{"slow", {0.05, 0.05, -0.05}, 1e-6},
                                         Case{"all_open_at_once", {1, -1, 1}, 5e-5}, Case{"closed", {0, 0, 0}, 1e-9},
                                         Case{"mixed_on_compliant_pins", {0.3, -0.2, 0.25}, 0, 0.3, true}),
                         [](const auto& c) { return std::string(c.param.name); });

}  // namespace
}  // namespace knuckle::sim
