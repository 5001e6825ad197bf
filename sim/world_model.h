// The running world: contact forces on the bucket as functions of its motion, and what changes slowly (damage, loose
// pieces, what the bucket carries) moved on after each substep.
#pragma once

#include <optional>
#include <vector>

#include "sim/contact.h"
#include "sim/rigid_body.h"
#include "sim/soil.h"
#include "sim/world.h"

namespace knuckle::sim {

class WorldModel {
 public:
  /// @param machine whose bucket it is: outline, and where scooped loads sit.
  WorldModel(const WorldDescription& description, const MachineDescription& machine);

  /// Nothing in it can be touched: forces() need not be asked.
  [[nodiscard]] bool empty() const noexcept { return empty_; }
  [[nodiscard]] ContactForces forces(const BucketMotion& bucket) const noexcept;
  /// After each substep. @return true where load or anchors moved, so that forces at the same motion are others.
  bool advance(double t_s, double dt, const BucketMotion& bucket) noexcept;
  /// Whether the bucket could touch something within a millisecond.
  [[nodiscard]] bool near(const BucketMotion& bucket) const noexcept;
  /// From t_s on one more weight hangs at the load point, or none (0); the one hung before goes.
  void hang(double mass_kg, double t_s);
  /// For the damping of walls touched next.
  void set_mobility(const Mobility& mobility, const BucketMotion& bucket) noexcept;

  [[nodiscard]] const BucketLoad& load() const noexcept { return load_; }
  [[nodiscard]] const WorldEventRing& events() const noexcept { return events_; }

 private:
  /// A cylinder across the arm's plane.
  struct Round {
    PlanarVector centre_m;
    double radius_m, stiffness_N_per_m, damping_Ns_per_m;
    double loose_kg = 0;                                                  ///< Lies loose on the ground; 0: fixed.
    [[nodiscard]] double most_N(const PlanarVector& out) const noexcept;  ///< That it takes in this direction.
  };
  enum class PieceState : std::uint8_t { kInWall, kFalling, kDown, kHeld };
  struct Piece {
    LoosePieceDescription data;
    PieceState state = PieceState::kDown;
    double down_at_s = 0;
    [[nodiscard]] Round round() const noexcept;
  };
  void add_round(PlanarVector ContactForces::*cause, const Round& round, const BucketMotion& bucket,
                 ContactForces& forces) const noexcept;
  void lay_down(Piece& piece, const BucketMotion& bucket) const noexcept;
  void slide(Piece& piece, const BucketMotion& bucket) const noexcept;
  void advance_walls(double t_s, double dt, const BucketMotion& bucket) noexcept;
  void advance_pieces(double t_s, const BucketMotion& bucket) noexcept;
  void advance_payload(double t_s, double dt, const BucketMotion& bucket) noexcept;
  bool update_load(double t_s) noexcept;
  void note_contact(double t_s, const ContactForces& forces) noexcept;

  WorldDescription description_;
  BucketOutline outline_;
  PlanarVector load_point_;
  bool empty_;
  std::vector<Wall> walls_;
  std::optional<Wall> ground_;
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
