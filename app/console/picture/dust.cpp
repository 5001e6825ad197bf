#include "app/console/picture/dust.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace knuckle::console::picture {
namespace {

using Eigen::Vector3d;

constexpr int kPuffs = 28;          // of a cloud of size 1
constexpr double kLife_s = 4;       // then it has settled
constexpr double kSlowing_s = 0.7;  // air takes the speed of a burst away
constexpr float kThickest = 0.16F;  // alpha of one puff
// In parts of the machine's reach:
constexpr double kBurst_1ps = 0.22, kRise_1ps = 0.02, kPuff = 0.02, kGrowth_1ps = 0.02;
constexpr double kDugApart = 0.04;  // soil: from one cloud to the next
constexpr double kBreak = 1, kFall = 0.7, kDump = 0.4, kDig = 0.25;
constexpr std::size_t kMostClouds = 24;

Puff puff_of(const Vector3d& from_m, const Vector3d& speed_mps, double age_s, double reach_m, double thick) {
  const double blown_s = kSlowing_s * (1 - std::exp(-age_s / kSlowing_s));
  const double left = 1 - age_s / kLife_s;
  return {from_m + blown_s * speed_mps + Vector3d(0, 0, kRise_1ps * reach_m * age_s),
          (kPuff + kGrowth_1ps * age_s) * reach_m, kThickest * static_cast<float>(thick * left)};
}

}  // namespace

Dust::Dust(const MachineDescription& machine) : kinematics_(machine), reach_m_(reach_m(machine)) {}

void Dust::begin(const sim::WorldDescription& world) {
  world_ = world;
  clouds_.clear();
  read_ = 0;
  watched_s_ = 0;
  dug_at_m_ = PlanarVector::Constant(1e9);
}

void Dust::watch(const session::MachineSight& sight) {
  if (sight.session_s < watched_s_ || sight.events.count < read_) begin(sim::WorldDescription(world_));  // restarted
  watched_s_ = sight.session_s;
  const PlanarVector tip_m = kinematics_.tip(sight.joint_rad);
  constexpr auto kCapacity = sim::WorldEventRing::kCapacity;
  read_ = std::max(read_, sight.events.count > kCapacity ? sight.events.count - kCapacity : 0);
  for (; read_ < sight.events.count; ++read_) take(sight.events.at(read_), tip_m);
  dig(tip_m, sight.session_s);
  std::erase_if(clouds_, [&](const Cloud& cloud) { return sight.session_s > cloud.born_s + kLife_s; });
  if (clouds_.size() > kMostClouds) clouds_.erase(clouds_.begin(), clouds_.end() - kMostClouds);
}

void Dust::take(const sim::WorldEvent& event, const PlanarVector& tip_m) {
  using Kind = sim::WorldEventKind;
  const auto wall = static_cast<std::size_t>(event.index);
  if (event.kind == Kind::kPieceBroke) clouds_.push_back({event.t_s, tip_m, kBreak});
  if (event.kind == Kind::kPieceDown && wall < world_.walls.size())
    clouds_.push_back({event.t_s, world_.walls[wall].piece_rest_m, kFall});
  if (event.kind == Kind::kDumped) clouds_.push_back({event.t_s, tip_m, kDump});
}

/// A little wherever the tip has gone on through the soil.
void Dust::dig(const PlanarVector& tip_m, double session_s) {
  for (const sim::SoilDescription& soil : world_.soil) {
    const PlanarVector along(std::cos(soil.slope_rad), std::sin(soil.slope_rad));
    const PlanarVector in = tip_m - soil.surface_point_m;
    if (cross(along, in) >= 0 || in.dot(along) < 0) continue;
    if ((tip_m - dug_at_m_).norm() < kDugApart * reach_m_) continue;
    dug_at_m_ = tip_m;
    clouds_.push_back({session_s, soil.surface_point_m + in.dot(along) * along, kDig});
  }
}

const std::vector<Puff>& Dust::at(double session_s) {
  puffs_.clear();
  for (const Cloud& cloud : clouds_) {
    const double age_s = session_s - cloud.born_s;
    if (age_s < 0 || age_s > kLife_s) continue;
    std::minstd_rand random(static_cast<std::uint32_t>(1 + 1000 * cloud.born_s));
    std::uniform_real_distribution<double> share(0, 1);
    const int puffs = std::max(3, static_cast<int>(kPuffs * cloud.size));
    for (int i = 0; i < puffs; ++i) {
      const double around = 2 * std::numbers::pi * share(random), up = share(random);
      const double speed = kBurst_1ps * reach_m_ * cloud.size * share(random);
      const Vector3d direction(std::cos(around), std::sin(around), up);
      puffs_.push_back(puff_of({cloud.at_m.x(), 0, cloud.at_m.y()}, speed * direction, age_s, reach_m_,
                               std::min(1.0, 2 * cloud.size)));
    }
  }
  return puffs_;
}

}  // namespace knuckle::console::picture
