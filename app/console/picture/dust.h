// Dust as a camera on a simulated machine sees it: a cloud where a piece breaks out of a wall, where one falls down,
// where a load is dropped, and where the bucket goes through soil. It hides what is behind it for a while, and does
// nothing else.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "app/session/scene.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "sim/world.h"

namespace knuckle::console::picture {

/// One ball of it; frame M with y to the left.
struct Puff {
  Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
  double radius_m = 0;
  float alpha = 0;
};

class Dust {
 public:
  explicit Dust(const MachineDescription& machine);

  /// Another session's world: no dust in it yet.
  void begin(const sim::WorldDescription& world);
  /// What has happened since the sight before makes its clouds.
  void watch(const session::MachineSight& sight);
  /// All that is in the air at a time of the session; valid until the next call. The same clouds always look the same.
  [[nodiscard]] const std::vector<Puff>& at(double session_s);

 private:
  struct Cloud {
    double born_s = 0;
    PlanarVector at_m = PlanarVector::Zero();
    double size = 1;  ///< 1: of a piece that breaks.
  };
  void take(const sim::WorldEvent& event, const PlanarVector& tip_m);
  void dig(const PlanarVector& tip_m, double session_s);

  const Kinematics kinematics_;
  const double reach_m_;
  sim::WorldDescription world_;
  std::uint64_t read_ = 0;
  double watched_s_ = 0;
  PlanarVector dug_at_m_ = PlanarVector::Constant(1e9);
  std::vector<Cloud> clouds_;
  std::vector<Puff> puffs_;
};

}  // namespace knuckle::console::picture
