#include "sim/world_model.h"

#include <algorithm>
#include <cmath>

namespace knuckle::sim {
namespace {

constexpr double kLoadTime_s = 0.3;       // a scooped piece's weight passes to the bucket in this time
constexpr double kCurling_radps = -0.02;  // clockwise = closing
constexpr double kSoon_s = 1e-9;
constexpr double kContactOn_N = 50;
constexpr double kContactGap_s = 0.05;  // shorter gaps are one contact

}  // namespace

const char* name(WorldEventKind kind) noexcept {
  switch (kind) {
    case WorldEventKind::kContact:
      return "contact";
    case WorldEventKind::kRelease:
      return "release";
    case WorldEventKind::kPieceBroke:
      return "piece_broke";
    case WorldEventKind::kPieceDown:
      return "piece_down";
    case WorldEventKind::kScooped:
      return "scooped";
    case WorldEventKind::kDug:
      return "dug";
    case WorldEventKind::kDumped:
      return "dumped";
    case WorldEventKind::kPipeTouched:
      return "pipe_touched";
    case WorldEventKind::kWeightOn:
      return "weight_on";
    case WorldEventKind::kWeightOff:
      return "weight_off";
  }
  return "";
}

WorldModel::WorldModel(const WorldDescription& description, const PlanarVector& load_point_m)
    : description_(description),
      load_point_(load_point_m),
      empty_(description.walls.empty() && description.soil.empty() && description.pipes.empty()),
      weight_on_(description.weights.size(), false) {
  for (const WallDescription& data : description.walls) {
    Wall wall;
    wall.data = data;
    wall.normal = data.normal.normalized();
    wall.along = perp(wall.normal);
    walls_.push_back(wall);
    pieces_.push_back({{data.piece_mass_kg, data.piece_rest_m}, PieceState::kInWall, 0});
  }
  for (const LoosePieceDescription& piece : description.pieces) pieces_.push_back({piece, PieceState::kDown, 0});
  if (!description.soil.empty()) soil_.emplace(description.soil.front());
}

void WorldModel::hang(double mass_kg, double t_s) {
  if (hung_) description_.weights.back().detach_at_s = t_s;
  hung_ = mass_kg > 0;
  if (!hung_) return;
  const double later_s = std::max(t_s, kSoon_s);  // a weight from time 0 would always have been there
  description_.weights.push_back({.mass_kg = mass_kg, .point_m = load_point_, .attach_at_s = later_s});
  weight_on_.push_back(false);
}

void WorldModel::set_mobility(const Eigen::Matrix2d& mobility) noexcept {
  for (Wall& wall : walls_) {
    if (wall.touched) continue;
    const double inverse_mass = wall.normal.dot(mobility * wall.normal);
    wall.damping_Ns_per_m = 2 * wall.data.damping_ratio * std::sqrt(wall.data.stiffness_N_per_m / inverse_mass);
  }
}

double WorldModel::normal_force(const Wall& wall, const PlanarVector& tip_m,
                                const PlanarVector& tip_mps) const noexcept {
  const PlanarVector offset = tip_m - wall.data.point_m;
  const double depth = -offset.dot(wall.normal);
  if (depth <= 0 || depth > wall.data.depth_m) return 0;
  const double sideways = offset.dot(wall.along);
  if (sideways < wall.data.from_m || sideways > wall.data.to_m) return 0;
  const double rate = -tip_mps.dot(wall.normal);
  if (wall.data.hunt_crossley_N_per_m15 > 0) {
    const double spring = wall.data.hunt_crossley_N_per_m15 * depth * std::sqrt(depth);
    return std::max(0.0, spring * (1 + 1.5 * wall.data.hunt_crossley_loss_s_per_m * rate));
  }
  return std::max(0.0, wall.data.stiffness_N_per_m * depth + wall.damping_Ns_per_m * rate);
}

ContactForces WorldModel::contact_forces(const PlanarVector& tip_m, const PlanarVector& tip_mps) const noexcept {
  ContactForces forces;
  for (const Wall& wall : walls_) {
    const double normal = normal_force(wall, tip_m, tip_mps);
    if (normal <= 0) continue;
    const double drag = wall.face.force(tip_m.dot(wall.along), tip_mps.dot(wall.along), wall.data.friction * normal);
    forces.wall += normal * wall.normal + drag * wall.along;
  }
  if (soil_) forces.soil = soil_->force(tip_m, tip_mps);
  for (const PipeDescription& pipe : description_.pipes) {
    const PlanarVector offset = tip_m - pipe.centre_m;
    const double distance2 = offset.squaredNorm();
    if (distance2 >= pipe.radius_m * pipe.radius_m || distance2 <= 1e-12) continue;
    const double distance = std::sqrt(distance2);
    const PlanarVector out = offset / distance;
    const double push = pipe.stiffness_N_per_m * (pipe.radius_m - distance) - pipe.damping_Ns_per_m * out.dot(tip_mps);
    forces.pipe += std::max(0.0, push) * out;
  }
  return forces;
}

bool WorldModel::advance(double t_s, double dt, const BucketMotion& bucket) noexcept {
  bool touching = false;
  if (!empty_) {
    const ContactForces forces = contact_forces(bucket.tip_m, bucket.tip_mps);
    touching = forces.sum().squaredNorm() > 0;
    advance_walls(t_s, dt, bucket);
    if (soil_) soil_->advance(bucket.tip_m, bucket.tip_mps, bucket.blade, dt);
    note_contact(t_s, forces.sum().norm());
    const bool pipe = forces.pipe.squaredNorm() > 0;
    if (pipe && !pipe_touched_) events_.push({WorldEventKind::kPipeTouched, 0, t_s, forces.pipe.norm()});
    pipe_touched_ = pipe;
  }
  advance_pieces(t_s, bucket);
  advance_payload(t_s, dt, bucket);
  return update_load(t_s) || touching;
}

void WorldModel::advance_walls(double t_s, double dt, const BucketMotion& bucket) noexcept {
  for (std::size_t i = 0; i < walls_.size(); ++i) {
    Wall& wall = walls_[i];
    const double normal = normal_force(wall, bucket.tip_m, bucket.tip_mps);
    wall.touched = normal > 0;
    wall.face.drag(bucket.tip_m.dot(wall.along), wall.data.friction * normal);
    if (wall.broken || wall.data.break_force_N <= 0) continue;
    wall.damage_Ns += std::max(0.0, normal - wall.data.break_force_N) * dt;
    if (wall.damage_Ns < wall.data.break_impulse_Ns) continue;
    wall.broken = true;
    wall.data.point_m -= wall.data.piece_depth_m * wall.normal;
    pieces_[i].state = PieceState::kFalling;
    pieces_[i].down_at_s = t_s + wall.data.fall_time_s;
    events_.push({WorldEventKind::kPieceBroke, static_cast<int>(i), t_s, normal});
  }
}

void WorldModel::advance_pieces(double t_s, const BucketMotion& bucket) noexcept {
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    Piece& piece = pieces_[i];
    if (piece.state == PieceState::kFalling && t_s >= piece.down_at_s) {
      piece.state = PieceState::kDown;
      events_.push({WorldEventKind::kPieceDown, static_cast<int>(i), t_s, piece.data.mass_kg});
    }
    const bool closing = bucket.rate_radps < kCurling_radps && bucket.angle_rad < description_.dump_angle_rad;
    if (piece.state != PieceState::kDown || !closing) continue;
    if ((bucket.tip_m - piece.data.position_m).squaredNorm() >
        description_.scoop_reach_m * description_.scoop_reach_m) {
      continue;
    }
    piece.state = PieceState::kHeld;
    wanted_kg_ += piece.data.mass_kg;
    events_.push({WorldEventKind::kScooped, static_cast<int>(i), t_s, piece.data.mass_kg});
  }
}

void WorldModel::advance_payload(double t_s, double dt, const BucketMotion& bucket) noexcept {
  const bool in_soil = soil_ && soil_->depth(bucket.tip_m) > 0;
  const bool open = bucket.angle_rad > description_.dump_angle_rad;
  if (in_soil && !open) {
    const double dug = std::min(soil_->swept_kgps(bucket.tip_m, bucket.tip_mps) * dt,
                                std::max(0.0, soil_->capacity_kg() - wanted_kg_));
    wanted_kg_ += dug;
    dug_kg_ += dug;
  }
  if (in_soil_ && !in_soil && dug_kg_ > 1) {
    events_.push({WorldEventKind::kDug, 0, t_s, dug_kg_});
    dug_kg_ = 0;
  }
  in_soil_ = in_soil;
  if (open && !in_soil && wanted_kg_ > 0) {
    events_.push({WorldEventKind::kDumped, 0, t_s, wanted_kg_});
    wanted_kg_ = 0;
  }
  constexpr double kFullLoad_kg = 50;
  const double most = std::max(kFullLoad_kg, std::max(wanted_kg_, carried_kg_)) / kLoadTime_s * dt;
  carried_kg_ = std::clamp(wanted_kg_, carried_kg_ - most, carried_kg_ + most);
}

bool WorldModel::update_load(double t_s) noexcept {
  BucketLoad load;
  load.add(carried_kg_, load_point_);
  for (std::size_t i = 0; i < weight_on_.size(); ++i) {
    const DeadWeightDescription& weight = description_.weights[i];
    const bool on = t_s >= weight.attach_at_s && t_s < weight.detach_at_s;
    if (on != weight_on_[i]) {
      events_.push(
          {on ? WorldEventKind::kWeightOn : WorldEventKind::kWeightOff, static_cast<int>(i), t_s, weight.mass_kg});
      weight_on_[i] = on;
    }
    const double since = t_s - weight.attach_at_s, left = weight.detach_at_s - t_s;
    const double part = std::clamp(std::min(since, left + kLoadTime_s) / kLoadTime_s, 0.0, 1.0);
    // A weight that is there from the start hangs from the start.
    load.add(weight.mass_kg * (weight.attach_at_s <= 0 && on ? 1.0 : part), weight.point_m);
  }
  const bool changed = load.mass_kg != load_.mass_kg;
  load_ = load;
  return changed;
}

void WorldModel::note_contact(double t_s, double force_N) noexcept {
  if (force_N > kContactOn_N) {
    if (!in_contact_) events_.push({WorldEventKind::kContact, 0, t_s, force_N});
    in_contact_ = true;
    last_contact_s_ = t_s;
    peak_N_ = std::max(peak_N_, force_N);
  } else if (in_contact_ && t_s - last_contact_s_ > kContactGap_s) {
    events_.push({WorldEventKind::kRelease, 0, t_s, peak_N_});
    in_contact_ = false;
    peak_N_ = 0;
  }
}

}  // namespace knuckle::sim
