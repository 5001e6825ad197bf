#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "app/battery/cell.h"
#include "core/error.h"
#include "core/units.h"
#include "machine/kinematics.h"
#include "sim/contact.h"
#include "sim/hull.h"
#include "sim/rigid_body.h"

namespace knuckle::battery {
namespace {

constexpr double kReach_m = 3.2;                // lengths below are for a machine of this reach
constexpr double kBeforeWall_m = 0.12;          // where a press begins
constexpr double kIntoWall_m = 0.06;            // what a soft wall gives way by
constexpr double kFromEnds_rad = 10 * kDegree;  // a joint's end is felt, too: not what is judged here
constexpr double kLinkageBehind_m = 0.03;       // the bucket's part that touches
constexpr double kClear_m = 0.05;               // of the wall and the ground while warming up
constexpr double kWallAbove_m = 0.15;           // of one between bucket and machine: the arm reaches over it
constexpr double kWallDepth_m = 0.5;            // of such a wall
constexpr double kLightGrip_N = 1.8;            // what a light grip is asked for at most
constexpr double kLeastPush = 0.1;              // of its weight that either end of the tracks must bear in a press
constexpr double kLeastFelt_N = 0.8;            // a place where the machine would tip by less is not pressed at
constexpr int kTries = 20000;
constexpr int kStarts = 6;  // angles of a joint that are tried as a start
const JointVector kSweep_rad = JointVector(8, 12, 15) * kDegree;

/// Which way the wall is from the machine, and where on it the press is.
struct Place {
  const char* name;
  double x_low, x_high, z_low, z_high;
  double angle_low_deg, angle_high_deg;  ///< Of the press.
  bool reached_over = false;             ///< The wall stands between bucket and machine.
  double bucket_low_deg = -150, bucket_high_deg = 20;
};
constexpr std::array<Place, 5> kPlaces{{{"front", 1.8, 2.5, -0.3, 0.6, 0, 0},
                                        {"ground", 1.5, 2.4, -0.6, -0.2, -90, -90},
                                        {"tilted", 1.8, 2.3, -0.5, 0.3, -70, -20},
                                        {"overhead", 1.5, 2.6, 1.2, 2.3, 90, 90, false, 10, 80},
                                        {"pull", 1.2, 1.9, -0.5, 0.2, 180, 180, true}}};
/// In the order of bucket_outline().
constexpr auto kPin =
    static_cast<std::size_t>(sim::BucketPlace::kPin);  // the end of the arm: no part of a bucket to press with

struct Press {
  const Place* place = nullptr;
  PlanarVector wall_m, along;  ///< Where it is touched, and the direction of the press.
  double bucket_rad = 0;
  std::size_t part = 0;     ///< Of the bucket's outline, that touches.
  PlanarVector approach_m;  ///< Tip.
  JointVector approach_rad, touch_rad, start_rad;
};

class Room {
 public:
  Room(const MachineDescription& machine, const sim::HullTruth& hull)
      : machine_(machine),
        hull_(hull),
        kinematics_(machine),
        outline_(bucket_outline(machine)),
        scale_(reach_m(machine) / kReach_m) {}

  [[nodiscard]] double scale() const noexcept { return scale_; }

  /// @return whether there is room for it; then the rest of it is worked out.
  bool fits(Press& press) const {
    const Eigen::Rotation2Dd turn(press.bucket_rad);
    double furthest = 0;
    for (std::size_t i = 0; i < outline_.size(); ++i) {
      const double ahead = press.along.dot(turn * (outline_[i] - outline_[0]));
      if (ahead > furthest + 1e-9) {
        furthest = ahead;
        press.part = i;
      }
    }
    if (press.part == kPin) return false;
    const PlanarVector tip_m = press.wall_m - turn * (outline_[press.part] - outline_[0]);
    for (const double k : {-kBeforeWall_m, -kBeforeWall_m / 2, 0.0, kIntoWall_m}) {
      const auto joints_rad = within(tip_m + scale_ * k * press.along, press.bucket_rad);
      if (!joints_rad) return false;
      // The linkage would meet the wall first, or soon: no press with the bucket.
      const PlanarVector linkage_m = pose_of(machine_, *joints_rad).linkage_pin_m - scale_ * k * press.along;
      if (press.along.dot(press.wall_m - linkage_m) < scale_ * kLinkageBehind_m) return false;
    }
    press.touch_rad = *within(tip_m, press.bucket_rad);
    press.approach_m = tip_m - scale_ * kBeforeWall_m * press.along;
    press.approach_rad = *within(press.approach_m, press.bucket_rad);
    return clear(press.approach_rad, press) && find_start(press);
  }

  /// The largest force with which the machine presses there and stands, on level ground.
  [[nodiscard]] double standing_N(const Press& press) const {
    double most_N = std::numeric_limits<double>::infinity();
    if (hull_.stiffness_N_per_m == 0) return most_N;  // a hull that stands like a rock
    const sim::RigidBody body(machine_, 0);
    const JointVector still = JointVector::Zero();
    const sim::ArmForces arm =
        body.inverse_dynamics(body.pose(press.touch_rad), still, still, {}, {body.lift_mps2(), 0, 0});
    const PlanarVector pin_m = -hull_.centre_m, back = -press.along;
    const double weight_N = arm.force_N.y() + hull_.mass_kg * sim::kGravity_mps2;
    const auto alone_N = sim::pushes_at_rest_N(
        hull_, weight_N,
        arm.moment_Nm + cross(pin_m, arm.force_N) + cross(hull_.mass_kg * hull_.com_m, body.lift_mps2()));
    const auto per_N = sim::pushes_at_rest_N(hull_, -back.y(), -cross(pin_m + press.wall_m, back));
    for (const std::size_t end : {0U, 1U}) {
      if (per_N[end] < 0) most_N = std::min(most_N, (kLeastPush * weight_N - alone_N[end]) / per_N[end]);
    }
    return std::max(0.0, most_N);
  }

 private:
  /// Joint angles, away from their ends.
  [[nodiscard]] std::optional<JointVector> within(const PlanarVector& tip_m, double bucket_rad) const {
    auto joints = kinematics_.inverse(tip_m, bucket_rad);
    if (joints && !within(*joints)) joints.reset();
    return joints;
  }
  [[nodiscard]] bool within(const JointVector& joints_rad) const {
    for (std::size_t i = 0; i < kJoints; ++i) {
      const double q = joints_rad[static_cast<Eigen::Index>(i)];
      if (q < machine_.links[i].min_rad + kFromEnds_rad || q > machine_.links[i].max_rad - kFromEnds_rad) return false;
    }
    return true;
  }
  /// Off the wall: before it, above it or behind it.
  [[nodiscard]] bool off(const PlanarVector& at_m, const Press& press) const {
    const double before_m = press.along.dot(press.wall_m - at_m);
    if (before_m > clear_m_) return true;
    if (!press.place->reached_over) return false;
    return at_m.y() - press.wall_m.y() > scale_ * kWallAbove_m + clear_m_ ||
           -before_m > scale_ * kWallDepth_m + clear_m_;
  }
  /// Nothing of arm and bucket near wall or ground.
  [[nodiscard]] bool clear(const JointVector& joints_rad, const Press& press) const {
    const MachinePose pose = pose_of(machine_, joints_rad);
    for (const PlanarVector& corner : outline_) {
      const PlanarVector at = pose.bucket * corner;
      if (!off(at, press) || at.y() < ground_level_m(machine_) + clear_m_) return false;
    }
    for (const Frame2* link : {&pose.boom, &pose.arm}) {
      const double length_m = machine_.links[static_cast<std::size_t>(link == &pose.boom ? kBoom : kArm)].length_m;
      for (const double share : {0.2, 0.4, 0.6, 0.8, 1.0}) {
        if (!off(*link * PlanarVector(share * length_m, 0), press)) return false;
      }
    }
    return off(pose.linkage_pin_m, press);
  }
  /// The nearest pose about which there is room to warm up.
  [[nodiscard]] bool find_start(Press& press) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (int candidate = 0; candidate < kStarts * kStarts * kStarts; ++candidate) {
      const JointVector at =
          share_of_range({candidate % kStarts, candidate / kStarts % kStarts, candidate / (kStarts * kStarts)});
      const double distance = (at - press.approach_rad).norm();
      if (distance >= nearest || !sweeps_clear(at, press)) continue;
      nearest = distance;
      press.start_rad = at;
    }
    return std::isfinite(nearest);
  }
  /// @param step of each joint: 0 to kStarts - 1, from where a sweep just stays within the range to where it does
  /// again.
  [[nodiscard]] JointVector share_of_range(const std::array<int, kJoints>& step) const {
    JointVector at;
    for (std::size_t i = 0; i < kJoints; ++i) {
      const auto n = static_cast<Eigen::Index>(i);
      const double low = machine_.links[i].min_rad + kSweep_rad[n], high = machine_.links[i].max_rad - kSweep_rad[n];
      at[n] = low + (high - low) * step[i] / (kStarts - 1);
    }
    return at;
  }
  [[nodiscard]] bool sweeps_clear(const JointVector& start_rad, const Press& press) const {
    // Every corner of the box of angles that the sweep can reach, and the way from it.
    for (int corner = 0; corner < 27; ++corner) {
      const Eigen::Vector3i way(corner % 3 - 1, corner / 3 % 3 - 1, corner / 9 - 1);
      if (!clear(start_rad + way.cast<double>().cwiseProduct(kSweep_rad), press)) return false;
    }
    for (const double way : {0.25, 0.5, 0.75}) {
      if (!clear(start_rad + way * (press.approach_rad - start_rad), press)) return false;
    }
    return true;
  }

  const MachineDescription& machine_;
  const sim::HullTruth& hull_;
  Kinematics kinematics_;
  std::array<PlanarVector, 6> outline_;
  double scale_;
  double clear_m_ = std::max(1.0, scale_) * kClear_m;
};

/// @throws InputError
Press draw(const Room& room, double least_N, const std::string& machine, std::mt19937_64& random) {
  const Place& place = kPlaces[pick(random, kPlaces.size())];
  for (int i = 0; i < kTries; ++i) {
    Press press;
    press.place = &place;
    const double x = between(random, place.x_low, place.x_high), z = between(random, place.z_low, place.z_high);
    press.wall_m = room.scale() * PlanarVector(x, z);
    const double angle = kDegree * between(random, place.angle_low_deg, place.angle_high_deg);
    press.along = PlanarVector(std::cos(angle), std::sin(angle));
    press.bucket_rad = kDegree * between(random, place.bucket_low_deg, place.bucket_high_deg);
    if (room.fits(press) && room.standing_N(press) >= least_N) return press;
  }
  throw InputError(machine + ": no room for a press: " + std::string(place.name));
}

constexpr const char* kScenario = R"(name = "{name}"
description = "A drawn press: {place} wall, met by the bucket's {part}."
reference_reach_m = {reach}
reference_payload_kg = {payload}
start_deg = [{start}]
hand_deg = [{hand}]
duration_s = 120

[operator]
limb = "{limb}"
reaction_ms = {reaction_ms:.0f}
person = "{person}"

[[phase]]
name = "engage"
kind = "engage"

[[phase]]
name = "warm_up"
kind = "sweep"
amplitude_deg = [{sweep}]
period_s = [9, 7, 5.5]
duration_s = 15

[[phase]]
name = "approach"
kind = "move"
tip_m = [{approach}]
bucket_deg = {bucket_deg:.4f}
speed_mps = {approach_mps:.4f}
timeout_s = 40

[[phase]]
name = "press"
kind = "press"
direction = [{along}]
speed_mps = {speed:.5f}
felt_N = {felt:.4f}
hold_s = 8
timeout_s = 40

[[phase]]
name = "release"
kind = "move"
tip_m = [{approach}]
bucket_deg = {bucket_deg:.4f}
speed_mps = {approach_mps:.4f}
timeout_s = 40

[[wall]]
point_m = [{wall}]
normal = [{normal}]
stiffness_N_per_m = {stiffness:.6g}
damping_ratio = {damping:.4f}
friction = {friction:.4f}
{ends})";

/// What a press must be to be stable and right; the whole session by what is felt of the truth.
constexpr const char* kCriteria = R"(
[[criteria]]
metric = "faults"
max = 0
[[criteria]]
metric = "phases_timed_out"
max = 0
[[criteria]]
metric = "contact_losses"
max = 2
[[criteria]]
metric = "hold_peak_to_peak_N"
max = 1
[[criteria]]
metric = "hold_true_swing_share"
max = 1
[[criteria]]
metric = "hold_error_share"
max = 1
[[criteria]]
metric = "unfelt_s"
max = 0
)";

std::string list_of(const JointVector& angles_rad) {
  return fmt::format("{:.6f}, {:.6f}, {:.6f}", angles_rad[0] / kDegree, angles_rad[1] / kDegree,
                     angles_rad[2] / kDegree);
}
std::string list_of(const PlanarVector& point) {
  return fmt::format("{:.6f}, {:.6f}", point.x(), point.y());
}

/// The hand begins a little away from the machine's pose, within its range.
JointVector hand_beside(const MachineDescription& machine, JointVector pose_rad) {
  const JointVector beside = pose_rad + JointVector(2, -2, 2) * kDegree;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    pose_rad[i] = std::clamp(beside[i], link.min_rad, link.max_rad);
  }
  return pose_rad;
}

}  // namespace

void draw_press(const MachineDescription& machine, const sim::HullTruth& hull, double force_scale,
                const Settings& settings, std::mt19937_64& random, Cell& cell) {
  const Room room(machine, hull);
  const Press press = draw(room, std::min(settings.felt_N.low, kLeastFelt_N) / force_scale, machine.source, random);
  const char* part = sim::name(static_cast<sim::BucketPlace>(press.part));
  const sim::LimbClass limb = draw_limb(random);
  const double light = limb == sim::LimbClass::kLightGrip ? kLightGrip_N : settings.felt_N.high;
  const bool exact = settings.person == sim::name(sim::PersonClass::kExact);
  const double most_felt = std::min(
      {settings.felt_N.high, light, exact ? light : sim::sustained_N(limb), force_scale * room.standing_N(press)});
  const double felt = between(random, std::min(settings.felt_N.low, most_felt), most_felt);
  const double speed = by_ratio(random, settings.speed_mps), reaction_ms = between(random, 120, 350);
  const double stiffness = by_ratio(random, settings.stiffness_N_per_m);
  const double damping = between(random, 0.05, 0.5), friction = between(random, 0.1, 0.7);
  cell.options.scenario_text =
      fmt::format(
          kScenario, fmt::arg("name", cell.options.scenario), fmt::arg("place", press.place->name),
          fmt::arg("part", part), fmt::arg("reach", reach_m(machine)),
          fmt::arg("payload", machine.payload_full_scale_kg), fmt::arg("start", list_of(press.start_rad)),
          fmt::arg("hand", list_of(hand_beside(machine, press.start_rad))), fmt::arg("limb", sim::name(limb)),
          fmt::arg("reaction_ms", reaction_ms), fmt::arg("person", settings.person),
          fmt::arg("sweep", list_of(kSweep_rad)), fmt::arg("approach", list_of(press.approach_m)),
          fmt::arg("bucket_deg", press.bucket_rad / kDegree), fmt::arg("approach_mps", 0.3 * room.scale()),
          fmt::arg("along", list_of(press.along)), fmt::arg("speed", speed), fmt::arg("felt", felt),
          fmt::arg("wall", list_of(press.wall_m)), fmt::arg("normal", list_of(PlanarVector(-press.along))),
          fmt::arg("stiffness", stiffness), fmt::arg("damping", damping), fmt::arg("friction", friction),
          fmt::arg("ends",
                   press.place->reached_over ? fmt::format("to_m = {:.6f}\n", kWallAbove_m * room.scale()) : "")) +
      kCriteria;
  cell.drawn["place"] = press.place->name;
  cell.drawn["part"] = part;
  cell.drawn["limb"] = sim::name(limb);
  cell.drawn["reaction_ms"] = reaction_ms;
  cell.drawn["stiffness_N_per_m"] = stiffness;
  cell.drawn["speed_mps"] = speed;
  cell.drawn["felt_N"] = felt;
}

}  // namespace knuckle::battery
