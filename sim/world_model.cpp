#include "sim/world_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace knuckle::sim {
namespace {

constexpr double kLoadTime_s = 0.3;       // a scooped piece's weight passes to the bucket in this time
constexpr double kCurling_radps = -0.02;  // clockwise = closing
constexpr double kSoon_s = 1e-9;
constexpr double kRubble_kg_per_m2 = 1000;  // of a piece's outline: concrete as wide as a small bucket
constexpr double kPiece_N_per_m = 2e6, kPiece_Ns_per_m = 1e4;
constexpr double kPieceFriction = 0.6;  // on the ground
constexpr double kContactOn_N = 50;
constexpr double kContactGap_s = 0.05;  // shorter gaps are one contact

WallDescription face_of(const GroundDescription& ground) {
  return {.point_m = {0, ground.height_m},
          .normal = {0, 1},
          .stiffness_N_per_m = ground.stiffness_N_per_m,
          .damping_ratio = ground.damping_ratio,
          .friction = ground.friction};
}

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

double piece_radius_m(double mass_kg) noexcept {
  return std::sqrt(mass_kg / (kRubble_kg_per_m2 * std::numbers::pi));
}

WorldModel::WorldModel(const WorldDescription& description, const MachineDescription& machine)
    : description_(description),
      outline_(machine),
      load_point_(machine.payload_com_m),
      empty_(!description.ground && description.walls.empty() && description.soil.empty() &&
             description.pipes.empty() && description.pieces.empty()),
      weight_on_(description.weights.size(), false) {
  if (description.ground) ground_.emplace(face_of(*description.ground));
  for (const WallDescription& wall : description.walls) {
    walls_.emplace_back(wall);
    pieces_.push_back({{wall.piece_mass_kg, wall.piece_rest_m}, PieceState::kInWall, 0});
  }
  for (const LoosePieceDescription& piece : description.pieces) pieces_.push_back({piece, PieceState::kDown, 0});
  if (!description.soil.empty()) {
    const auto& links = machine.links;
    soil_.emplace(description.soil.front(), outline_,
                  links[kBoom].length_m + links[kArm].length_m + links[kBucket].length_m);
  }
}

void WorldModel::hang(double mass_kg, double t_s) {
  if (hung_) description_.weights.back().detach_at_s = t_s;
  hung_ = mass_kg > 0;
  if (!hung_) return;
  const double later_s = std::max(t_s, kSoon_s);  // a weight from time 0 would always have been there
  description_.weights.push_back({.mass_kg = mass_kg, .point_m = load_point_, .attach_at_s = later_s});
  weight_on_.push_back(false);
}

void WorldModel::set_mobility(const Mobility& mobility, const BucketMotion& bucket) noexcept {
  if (ground_) ground_->set_mobility(mobility, bucket, outline_);
  for (Wall& wall : walls_) wall.set_mobility(mobility, bucket, outline_);
}

void WorldModel::add_round(PlanarVector ContactForces::*cause, const Round& round, const BucketMotion& bucket,
                           ContactForces& forces) const noexcept {
  const auto push = [&](const PlanarVector& out, double depth_m, const PlanarVector& velocity_mps) {
    const double force = round.stiffness_N_per_m * depth_m - round.damping_Ns_per_m * out.dot(velocity_mps);
    return PlanarVector(std::clamp(force, 0.0, round.most_N(out)) * out);
  };
  constexpr double kCentre_m = 1e-6;  // nearer to the centre no direction is out
  const PlanarVector centre_m = bucket.turn.back(round.centre_m - bucket.pin_m);
  if (centre_m.norm() > outline_.radius_m() + round.radius_m) return;
  const PlanarVector near_m = outline_.nearest(centre_m);
  const std::size_t side = outline_.nearest_side(centre_m);
  const bool inside =
      outline_.outside(side, centre_m) <= 0;  // its centre is in the bucket: out through the nearest side
  const double distance = inside ? -(near_m - centre_m).norm() : (near_m - centre_m).norm();
  if (distance < round.radius_m && (inside || distance > kCentre_m)) {
    const PlanarVector out =
        inside ? PlanarVector(-outline_.outward(side)) : PlanarVector((near_m - centre_m) / distance);
    const PlanarVector at_m = bucket.at(near_m);
    forces.on_bucket(cause, bucket, at_m, push(bucket.turn * out, round.radius_m - distance, bucket.velocity(at_m)));
  }
  const PlanarVector offset = bucket.linkage_m - round.centre_m;
  const double away = offset.norm();
  if (away >= round.radius_m || away <= kCentre_m) return;
  forces.on_linkage(cause, bucket, push(offset / away, round.radius_m - away, bucket.linkage_mps));
}

/// Friction mu (m g + F out_z) on the ground balances F |out_x|: it slides before it is pushed harder.
double WorldModel::Round::most_N(const PlanarVector& out) const noexcept {
  const double slope = std::abs(out.x()) - kPieceFriction * out.y();
  return loose_kg > 0 && slope > 0 ? kPieceFriction * kGravity_mps2 * loose_kg / slope
                                   : std::numeric_limits<double>::infinity();
}

WorldModel::Round WorldModel::Piece::round() const noexcept {
  return {data.position_m, piece_radius_m(data.mass_kg), kPiece_N_per_m, kPiece_Ns_per_m, data.mass_kg};
}

/// Where it was to lie, or beside it where the bucket is in the way.
void WorldModel::lay_down(Piece& piece, const BucketMotion& bucket) const noexcept {
  constexpr double kStep_m = 0.01, kFurthest_m = 3;
  const PlanarVector wanted_m = piece.data.position_m;
  for (int i = 0; kStep_m * i < 2 * kFurthest_m; ++i) {  // 1 cm to the one side, 1 cm to the other, 2 cm to the one ...
    piece.data.position_m.x() = wanted_m.x() + kStep_m * (i % 2 == 0 ? -i / 2 : (i + 1) / 2);
    ContactForces forces;
    add_round(&ContactForces::piece, piece.round(), bucket, forces);
    if (forces.weight_N == 0) return;
  }
}

/// Quasi-static: as deep as a piece that did not slide would be pressed harder than friction under it holds, it moves.
void WorldModel::slide(Piece& piece, const BucketMotion& bucket) const noexcept {
  Round fixed = piece.round();
  fixed.damping_Ns_per_m = fixed.loose_kg = 0;
  ContactForces forces;
  add_round(&ContactForces::piece, fixed, bucket, forces);
  const PlanarVector on_piece = -forces.piece;
  const double held = kPieceFriction * std::max(0.0, kGravity_mps2 * piece.data.mass_kg - on_piece.y());
  const double excess = std::abs(on_piece.x()) - held;
  if (excess > 0) piece.data.position_m.x() += std::copysign(excess / kPiece_N_per_m, on_piece.x());
}

ContactForces WorldModel::forces(const BucketMotion& bucket) const noexcept {
  ContactForces forces;
  if (ground_) ground_->add_forces(bucket, outline_, forces);
  for (const Wall& wall : walls_) wall.add_forces(bucket, outline_, forces);
  if (soil_) soil_->add_forces(bucket, outline_, forces);
  for (const PipeDescription& pipe : description_.pipes) {
    add_round(&ContactForces::pipe, {pipe.centre_m, pipe.radius_m, pipe.stiffness_N_per_m, pipe.damping_Ns_per_m},
              bucket, forces);
  }
  for (const Piece& piece : pieces_) {
    if (piece.state == PieceState::kDown) add_round(&ContactForces::piece, piece.round(), bucket, forces);
  }
  return forces;
}

bool WorldModel::near(const BucketMotion& bucket) const noexcept {
  constexpr double kNear_m = 0.01;
  if (empty_) return false;
  if (ground_ && ground_->clearance_m(bucket, outline_) < kNear_m) return true;
  for (const Wall& wall : walls_) {
    if (wall.clearance_m(bucket, outline_) < kNear_m) return true;
  }
  if (soil_ && soil_->clearance_m(bucket, outline_) < kNear_m) return true;
  const auto near_round = [&](const PlanarVector& centre_m, double radius_m) {
    const PlanarVector in_bucket = bucket.turn.back(centre_m - bucket.pin_m);
    if (in_bucket.norm() > outline_.radius_m() + radius_m + kNear_m) return false;
    return outline_.outside(outline_.nearest_side(in_bucket), in_bucket) < radius_m + kNear_m ||
           (bucket.linkage_m - centre_m).norm() < radius_m + kNear_m;
  };
  for (const PipeDescription& pipe : description_.pipes) {
    if (near_round(pipe.centre_m, pipe.radius_m)) return true;
  }
  for (const Piece& piece : pieces_) {
    if (piece.state == PieceState::kDown && near_round(piece.data.position_m, piece.round().radius_m)) return true;
  }
  return false;
}

bool WorldModel::advance(double t_s, double dt, const BucketMotion& bucket) noexcept {
  bool touching = false;
  if (!empty_) {
    const ContactForces now = forces(bucket);
    touching = now.weight_N > 0;
    if (ground_) ground_->advance(bucket, outline_, dt);
    advance_walls(t_s, dt, bucket);
    if (soil_) soil_->advance(bucket, outline_, dt);
    note_contact(t_s, now);
    const bool pipe = now.pipe.squaredNorm() > 0;
    if (pipe && !pipe_touched_) events_.push({WorldEventKind::kPipeTouched, 0, t_s, now.pipe.norm()});
    pipe_touched_ = pipe;
  }
  advance_pieces(t_s, bucket);
  advance_payload(t_s, dt, bucket);
  return update_load(t_s) || touching;
}

void WorldModel::advance_walls(double t_s, double dt, const BucketMotion& bucket) noexcept {
  for (std::size_t i = 0; i < walls_.size(); ++i) {
    const double broke_N = walls_[i].advance(bucket, outline_, dt);
    if (broke_N <= 0) continue;
    pieces_[i].state = PieceState::kFalling;
    pieces_[i].down_at_s = t_s + walls_[i].data().fall_time_s;
    events_.push({WorldEventKind::kPieceBroke, static_cast<int>(i), t_s, broke_N});
  }
}

void WorldModel::advance_pieces(double t_s, const BucketMotion& bucket) noexcept {
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    Piece& piece = pieces_[i];
    if (piece.state == PieceState::kFalling && t_s >= piece.down_at_s) {
      piece.state = PieceState::kDown;
      lay_down(piece, bucket);
      events_.push({WorldEventKind::kPieceDown, static_cast<int>(i), t_s, piece.data.mass_kg});
    }
    if (piece.state == PieceState::kDown) slide(piece, bucket);
    const bool closing = bucket.rate_radps < kCurling_radps && bucket.angle_rad < description_.dump_angle_rad;
    if (piece.state != PieceState::kDown || !closing) continue;
    const double away_m = (bucket.at(outline_.tip()) - piece.data.position_m).norm() - piece.round().radius_m;
    if (away_m > description_.scoop_reach_m) continue;
    piece.state = PieceState::kHeld;
    wanted_kg_ += piece.data.mass_kg;
    events_.push({WorldEventKind::kScooped, static_cast<int>(i), t_s, piece.data.mass_kg});
  }
}

void WorldModel::advance_payload(double t_s, double dt, const BucketMotion& bucket) noexcept {
  const bool in_soil = soil_ && soil_->cutting_depth_m() > 0;
  const bool open = bucket.angle_rad > description_.dump_angle_rad;
  if (in_soil && !open) {
    const double dug = std::min(soil_->swept_kgps() * dt, std::max(0.0, soil_->capacity_kg() - wanted_kg_));
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

void WorldModel::note_contact(double t_s, const ContactForces& forces) noexcept {
  const double force_N = forces.sum().norm();
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
