// The running world: contact forces at the tip as functions of its motion, and what changes slowly (damage, loose
// pieces, what the bucket carries) moved on after each substep.
#pragma once

#include <optional>
#include <vector>

#include "sim/rigid_body.h"
#include "sim/soil.h"
#include "sim/world.h"

namespace knuckle::sim {

struct ContactForces {  ///< On the machine, frame W.
  PlanarVector wall = PlanarVector::Zero(), soil = PlanarVector::Zero(), pipe = PlanarVector::Zero();
  [[nodiscard]] PlanarVector sum() const noexcept { return wall + soil + pipe; }
};

/// How the bucket moves, frame W.
struct BucketMotion {
  PlanarVector tip_m, tip_mps;
  PlanarVector blade;  ///< Unit vector from bucket pin to tip.
  double angle_rad;    ///< To the horizontal, not wrapped.
  double rate_radps;
};

class WorldModel {
 public:
  /// @param load_point_m where scooped loads sit, bucket axes.
  WorldModel(const WorldDescription& description, const PlanarVector& load_point_m);

  [[nodiscard]] ContactForces forces(const PlanarVector& tip_m, const PlanarVector& tip_mps) const noexcept {
    if (empty_) return {};
    return contact_forces(tip_m, tip_mps);
  }
  /// After each substep. @return true where load or anchors moved, so that forces at the same motion are others.
  bool advance(double t_s, double dt, const BucketMotion& bucket) noexcept;
  /// From t_s on one more weight hangs at the load point, or none (0); the one hung before goes.
  void hang(double mass_kg, double t_s);
  /// Tip acceleration per force, frame W, for the damping of a wall touched next.
  void set_mobility(const Eigen::Matrix2d& mobility) noexcept;

  [[nodiscard]] const BucketLoad& load() const noexcept { return load_; }
  [[nodiscard]] const WorldEventRing& events() const noexcept { return events_; }

 private:
  struct Wall {
    WallDescription data;
    PlanarVector normal, along;
    double damping_Ns_per_m = 0;
    double damage_Ns = 0;
    bool broken = false, touched = false;
    Bristle face{2e6, 4e3};
  };
  enum class PieceState : std::uint8_t { kInWall, kFalling, kDown, kHeld };
  struct Piece {
    LoosePieceDescription data;
    PieceState state = PieceState::kDown;
    double down_at_s = 0;
  };
  [[nodiscard]] ContactForces contact_forces(const PlanarVector& tip_m, const PlanarVector& tip_mps) const noexcept;
  [[nodiscard]] double normal_force(const Wall& wall, const PlanarVector& tip_m,
                                    const PlanarVector& tip_mps) const noexcept;
  void advance_walls(double t_s, double dt, const BucketMotion& bucket) noexcept;
  void advance_pieces(double t_s, const BucketMotion& bucket) noexcept;
  void advance_payload(double t_s, double dt, const BucketMotion& bucket) noexcept;
  bool update_load(double t_s) noexcept;
  void note_contact(double t_s, double force_N) noexcept;

  WorldDescription description_;
  PlanarVector load_point_;
  bool empty_;
  std::vector<Wall> walls_;
  std::vector<Piece> pieces_;  // pieces of breakable walls first, one per wall; then those lying about
  std::optional<Soil> soil_;
  double carried_kg_ = 0, wanted_kg_ = 0;  // scooped and dug; carried follows wanted in a fraction of a second
  bool in_soil_ = false;
  double dug_kg_ = 0;
  std::vector<bool> weight_on_;
  bool hung_ = false;  // the last weight is one of hang()
  bool pipe_touched_ = false;
  bool in_contact_ = false;
  double last_contact_s_ = -1, peak_N_ = 0;
  BucketLoad load_;
  WorldEventRing events_;
};

}  // namespace knuckle::sim
