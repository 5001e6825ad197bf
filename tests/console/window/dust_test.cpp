// Dust before a simulated camera: where it comes up, and that it settles.
#include "app/console/picture/dust.h"

#include <gtest/gtest.h>

#include "tests/console/window/canned_console.h"

namespace knuckle::console::picture {
namespace {

class DustInTheAir : public testing::Test {
 protected:
  session::MachineSight sight(double session_s) const { return {Time{}, session_s, {0.5, -1.2, -0.4}, events_}; }
  PlanarVector tip() const { return Kinematics(machine_).tip({0.5, -1.2, -0.4}); }
  static PlanarVector middle(const std::vector<Puff>& puffs) {
    PlanarVector sum = PlanarVector::Zero();
    for (const Puff& puff : puffs) sum += PlanarVector(puff.at_m.x(), puff.at_m.z());
    return sum / static_cast<double>(puffs.size());
  }

  const MachineDescription machine_ = window::canned_facts().machine;
  sim::WorldEventRing events_;
  Dust dust_{machine_};
};

TEST_F(DustInTheAir, ComesUpWhereAPieceBreaksSpreadsAndSettles) {
  dust_.watch(sight(1));
  EXPECT_TRUE(dust_.at(1).empty()) << "nothing has broken yet";
  events_.push({sim::WorldEventKind::kPieceBroke, 0, 2.0, 3000});
  dust_.watch(sight(2.01));
  const auto fresh = dust_.at(2.05);
  ASSERT_GT(fresh.size(), 10u);
  EXPECT_LT((middle(fresh) - tip()).norm(), 0.1);
  const auto later = dust_.at(4);
  ASSERT_EQ(later.size(), fresh.size());
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    EXPECT_GT(later[i].radius_m, fresh[i].radius_m);
    EXPECT_LT(later[i].alpha, fresh[i].alpha);
  }
  Dust anew = dust_;
  dust_.watch(sight(7));
  EXPECT_TRUE(dust_.at(7).empty());
  events_ = {};
  anew.watch(sight(0.1));
  EXPECT_TRUE(anew.at(0.1).empty()) << "the session began anew";
}

TEST_F(DustInTheAir, ComesUpWhereThePieceFallsDown) {
  sim::WorldDescription world;
  world.walls.emplace_back().piece_rest_m = {1.85, -0.75};
  dust_.begin(world);
  events_.push({sim::WorldEventKind::kPieceDown, 0, 2.0, 45});
  dust_.watch(sight(2.01));
  ASSERT_FALSE(dust_.at(2.05).empty());
  EXPECT_LT((middle(dust_.at(2.05)) - PlanarVector(1.85, -0.75)).norm(), 0.1);
}

TEST_F(DustInTheAir, ComesUpFromSoilAsTheBucketGoesThroughIt) {
  sim::WorldDescription world;
  world.soil.emplace_back().surface_point_m = {0.5, tip().y() + 0.1};
  dust_.begin(world);
  dust_.watch(sight(1));
  const auto puffs = dust_.at(1.02);
  ASSERT_FALSE(puffs.empty());
  EXPECT_NEAR(middle(puffs).x(), tip().x(), 0.1);
  EXPECT_NEAR(middle(puffs).y(), tip().y() + 0.1, 0.05) << "at the surface";
  dust_.watch(sight(1.1));
  EXPECT_EQ(dust_.at(1.1).size(), puffs.size()) << "a bucket that stands makes no more";
}

}  // namespace
}  // namespace knuckle::console::picture
