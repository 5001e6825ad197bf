#include "app/studies/contact_run.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "app/motion/led_machine.h"
#include "app/motion/path_builder.h"
#include "core/loop_table.h"
#include "machine/kinematics.h"
#include "sim/machine_on_bus.h"

namespace knuckle::studies {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kStep_s = 0.1;  // of the small step: no faster than a valve opens
constexpr Duration kLate = 1s;

ContactPose pose_of(std::string name, double boom_deg, double arm_deg, double bucket_deg, const PlanarVector& normal,
                    const PlanarVector& place_m) {
  return {std::move(name), kDegree * JointVector(boom_deg, arm_deg, bucket_deg), normal.normalized(), place_m};
}

PlanarVector place_in_machine(const Kinematics& kinematics, const MachineDescription& machine,
                              const ContactPose& pose) {
  const PlanarVector tip(machine.links[kBucket].length_m, 0);
  return kinematics.tip(pose.joint_rad) + Eigen::Rotation2Dd(pose.joint_rad.sum()) * (pose.place_m - tip);
}

sim::WorldDescription world_of(const ContactTrial& trial, const PlanarVector& touch_m) {
  sim::WallDescription wall;
  wall.point_m = touch_m;
  wall.normal = trial.pose.normal;
  wall.stiffness_N_per_m = trial.wall_N_per_m;
  wall.damping_ratio = trial.wall_damping_ratio;
  wall.friction = trial.wall_friction;
  sim::WorldDescription world;
  world.walls.push_back(wall);
  return world;
}

/// The pose with its tip moved, the bucket's own angle kept.
JointVector moved(const Kinematics& kinematics, const ContactPose& pose, double along_normal_m) {
  const PlanarVector tip = kinematics.tip(pose.joint_rad) + along_normal_m * pose.normal;
  const auto joints = kinematics.inverse(tip, pose.joint_rad.sum());
  if (!joints) throw motion::NotLed("pose " + pose.name + ": the set-point is out of reach");
  return *joints;
}

double depth_m(const ContactTrial& trial, double push_N) {
  return push_N / trial.machine.control.tip_stiffness_N_per_m + push_N / trial.wall_N_per_m;
}

/// Speed up to ram_mps over its first part, go on, stop over the last centimetre: straight lines of speed.
void ram(const ContactTrial& trial, const Kinematics& kinematics, double period_s, motion::PathBuilder& path) {
  constexpr double kStop_m = 0.01, kStart_mps2 = 1;
  const double end_m = -depth_m(trial, trial.press_N);
  double at_m = trial.gap_m, speed_mps = 0;
  while (at_m > end_m + 1e-4) {
    const double allowed_mps = trial.ram_mps * std::sqrt(std::min(1.0, (at_m - end_m) / kStop_m));
    speed_mps = std::min({speed_mps + kStart_mps2 * period_s, trial.ram_mps, std::max(0.01, allowed_mps)});
    at_m = std::max(end_m, at_m - speed_mps * period_s);
    path.move(moved(kinematics, trial.pose, at_m), period_s);
  }
}

/// @param stepped out: milliseconds to the small step.
motion::PathBuilder path_of(const ContactTrial& trial, const Kinematics& kinematics, const JointVector& start_rad,
                            double period_s, std::size_t& stepped) {
  const double pressed_m = depth_m(trial, trial.press_N);
  motion::PathBuilder path(start_rad, period_s);
  if (trial.ram_mps > 0) {
    ram(trial, kinematics, period_s, path);
  } else {
    path.move(moved(kinematics, trial.pose, -pressed_m),
              motion::PathBuilder::kPeak * (trial.gap_m + pressed_m) / trial.approach_mps);
  }
  path.hold(trial.settle_s);
  stepped = static_cast<std::size_t>(std::lround(period_s / to_seconds(kTick) * static_cast<double>(path.size())));
  path.move(moved(kinematics, trial.pose, -depth_m(trial, trial.press_N + trial.step_N)), kStep_s);
  path.hold(trial.watch_s);
  return path;
}

class Watch {
 public:
  Watch(const ContactTrial& trial, const PlanarVector& touch_m) : trial_(trial), touch_m_(touch_m) {}
  void look(const sim::PlantState& s) {
    ContactSample sample;
    sample.t_s = s.t_s;
    sample.push_N = s.contact_N.dot(trial_.pose.normal);
    sample.along_N = cross(trial_.pose.normal, s.contact_N);
    const PlanarVector tip(trial_.truth.machine.links[kBucket].length_m, 0);
    const PlanarVector place = s.tip_m + Eigen::Rotation2Dd(s.joint_rad.sum()) * (trial_.pose.place_m - tip);
    sample.gap_m = (place - touch_m_).dot(trial_.pose.normal);
    sample.joint_rad = s.joint_rad;
    sample.chamber_Pa = s.chamber_Pa;
    record.samples.push_back(sample);
  }
  ContactRecord record;

 private:
  const ContactTrial& trial_;
  PlanarVector touch_m_;
};

}  // namespace

std::vector<ContactPose> contact_poses(const MachineDescription& machine) {
  const PlanarVector tip(machine.links[kBucket].length_m, 0);
  return {pose_of("front", 20, -80, 30, {-1, 0}, tip),
          pose_of("ground", 15, -85, -30, {0, 1}, tip),
          pose_of("tilted", 15, -80, -5, {-1, 1}, tip),
          pose_of("overhead", 55, -45, 38, {0, -1}, tip),
          pose_of("pull", 20, -100, -50, {1, 0}, tip),
          pose_of("back", 40, -105, -30, {-1, 0}, machine.bucket_profile.back_m)};
}

ContactRecord run_contact(const ContactTrial& trial) {
  const Kinematics kinematics(trial.truth.machine);
  const PlanarVector touch_m = place_in_machine(kinematics, trial.truth.machine, trial.pose);
  const JointVector start = moved(kinematics, trial.pose, trial.gap_m);
  const auto machine = std::make_shared<sim::MachineOnBus>(trial.truth, world_of(trial, touch_m), start, trial.seed);
  BusAccess access = sim::access_to(machine);
  motion::LedMachine led(trial.machine, access, Time(sim::period_in_ticks(trial.machine)));
  Watch watch(trial, touch_m);
  try {
    led.engage();
    led.settle(500ms, 2s);
    machine->each_tick = [&](sim::MachineOnBus& m) { watch.look(m.plant()); };
    led.show((trial.press_N + trial.step_N) * trial.pose.normal);
    const motion::PathBuilder path = path_of(trial, kinematics, start, to_seconds(led.period()), watch.record.stepped);
    led.lead(path.path());
    const Duration way = from_seconds(static_cast<double>(path.size()) * to_seconds(led.period()));
    if (!led.run_until([&] { return led.done(); }, way + kLate))
      watch.record.trouble = "the path was not led to its end";
  } catch (const motion::NotLed& e) {
    watch.record.trouble = e.what();
  }
  machine->each_tick = {};
  return std::move(watch.record);
}

}  // namespace knuckle::studies
