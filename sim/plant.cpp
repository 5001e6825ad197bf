#include "sim/plant.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "sim/hydraulics.h"
#include "sim/plant_model.h"

namespace knuckle::sim {
namespace {

// Compiled without Eigen's packets (CMakeLists.txt): what is passed in and out must look as elsewhere.
static_assert(alignof(PlanarVector) == 16 && alignof(StateVector) == 16);

/// Powers whose integrals are the ledger, in its order; trapezoidal sums over the substeps.
struct Powers {
  double pump_in = 0, pump_out = 0, pump_lost = 0;
  std::array<double, kJoints> valve_in{}, valve_out{}, valve_lost{};
  std::array<double, kJoints> chamber_in{}, chamber_out{}, chamber_lost{};
  std::array<double, kJoints> piston_lost{}, piston_out{};
  double contact = 0, ground_lost = 0, joint_stop_lost = 0, valve_work = 0;
};

}  // namespace

struct Plant::Impl {
  Impl(const MachineTruth& truth, const WorldDescription& description, const JointVector& start_rad)
      : model(truth),
        world(description, truth.machine),
        spools{spool_of(truth, 0), spool_of(truth, 1), spool_of(truth, 2)} {
    x.setZero();
    x.segment<3>(kAngle) = start_rad;
    detail.pose = model.body().pose(start_rad);
    world.advance(0, 0, model.bucket_motion(x, detail.pose));  // loads that hang from the start
    held.load = world.load();
    x = model.equilibrium(start_rad, held.load);
    check_start(truth);
    slope = model.derivative(x, held, world, detail);
    near = world.near(model.bucket_motion(x, detail.pose));
    last = powers();
    refresh_mobility();
    publish();
  }
  /// What starts inside something would be thrown out of it.
  void check_start(const MachineTruth& truth) const {
    constexpr double kMost_N = 20e3;
    if (world.forces(model.bucket_motion(x, detail.pose)).weight_N <= kMost_N) return;
    throw InputError((truth.machine.source.empty() ? "truth" : truth.machine.source) +
                     ": start: puts the bucket into a wall, the ground or a piece");
  }
  static Spool spool_of(const MachineTruth& truth, std::size_t i) {
    return {truth.machine.cylinders[i].valve, truth.valve[i], kSubstep_s};
  }
  void tick(std::int64_t count) noexcept {
    warmth_K = model.truth().warm_up.at(state.t_s);
    model.warm(warmth_K);
    moved_world |= model.truth().warm_up.rise_K != 0;
    // Whole milliseconds where nothing can be touched within one and no pin yields, halves else.
    constexpr std::int64_t kMillisecond = 4, kHalf = 2;
    for (std::int64_t left = count; left > 0; left -= kMillisecond) {
      const std::int64_t parts = std::min(left, kMillisecond),
                         each = std::min(parts, near || model.pins_compliant() ? kHalf : kMillisecond);
      for (std::int64_t part = 0; part < parts; part += each) step(std::min(each, parts - part));
    }
    refresh_mobility();
    publish();
  }

  /// @param parts of kSubstep_s each.
  void step(std::int64_t parts) noexcept;
  void refresh_mobility() noexcept;
  [[nodiscard]] Powers powers() const noexcept;
  void account(const Powers& now, double h) noexcept;
  void publish() noexcept;
  void publish_stored() noexcept;

  PlantModel model;
  WorldModel world;
  PerJoint<Spool> spools;
  bool pilot = false;
  double warmth_K = 0;
  bool near = true;  // something could be touched
  // Whether forces on the arm may be others now than where `slope` was taken, beside the valves' oil.
  bool moved_world = true;
  PlanarVector pull_N = PlanarVector::Zero(), pull_at_m = PlanarVector::Zero();
  std::int64_t substeps = 0;
  StateVector x, slope;  // slope: derivative at x with the present inputs
  HeldInputs held;
  PlantDetail detail;  // belongs to slope
  Powers last;
  PlantState state;
};

void Plant::Impl::step(std::int64_t parts) noexcept {
  const double h = static_cast<double>(parts) * kSubstep_s;
  for (std::size_t i = 0; i < kJoints; ++i) {
    double sum = 0;
    for (std::int64_t part = 0; part < parts; ++part) {
      spools[i].advance(pilot, warmth_K);
      sum += spools[i].opening();
    }
    held.opening[i] = sum / static_cast<double>(parts);
  }
  const bool only_valves = !moved_world && held.pull_N == pull_N && held.pull_at_m == pull_at_m;
  held.pull_N = pull_N;
  held.pull_at_m = pull_at_m;
  if (only_valves) {
    model.reopen(x, held, detail, slope);
  } else {
    slope = model.derivative(x, held, world, detail, PlantModel::Geometry::kNear);  // at the same angles
  }
  last = powers();

  x = model.stepped(x, slope, detail, held, world, h);
  substeps += parts;
  state.energy.links.lost += model.settle(x, h);
  slope = model.derivative(x, held, world, detail, PlantModel::Geometry::kNear);
  account(powers(), h);
  const BucketMotion bucket = model.bucket_motion(x, detail.pose);
  const bool touched = world.advance(static_cast<double>(substeps) * kSubstep_s, h, bucket);
  const bool carried = held.load.mass_kg > 0;
  held.load = world.load();
  near = world.near(bucket);
  moved_world = touched || near || carried || held.load.mass_kg > 0 || model.hull().compliant();
}

void Plant::Impl::refresh_mobility() noexcept {
  if (!world.empty()) world.set_mobility(model.mobility(detail), detail.bucket);
}

Powers Plant::Impl::powers() const noexcept {
  Powers p;
  const double tank = model.truth().machine.hydraulics.tank_Pa;
  p.pump_in = x[kPump] * detail.pump_flow;
  p.pump_lost = x[kPump] * detail.main_relief_flow;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    const double pa = x[kHead + n], pb = x[kRod + n], v = detail.speed[n];
    const double qa = detail.head_flow[i], qb = detail.rod_flow[i], feed = detail.feed[i];
    const bool extends = held.opening[i] > 0;
    const double drain = held.opening[i] == 0 ? 0 : -(extends ? qb : qa);
    const double fed = extends ? pa : pb, emptied = extends ? pb : pa;
    p.pump_out += x[kPump] * feed;
    p.valve_in[i] = x[kPump] * feed + emptied * drain;
    p.valve_out[i] = fed * feed + tank * drain;
    p.valve_lost[i] = (x[kPump] - fed) * feed + (emptied - tank) * drain;
    p.valve_work += pa * qa + pb * qb;
    // Oil that fills a growing chamber brings its own compression along.
    p.chamber_in[i] = pa * (qa + detail.head_suck[i]) + pb * (qb + detail.rod_suck[i]) +
                      (model.oil().energy_density(pa) * model.axis(i).head_area_m2 -
                       model.oil().energy_density(pb) * model.axis(i).rod_area_m2) *
                          v;
    p.chamber_out[i] = detail.pressure_force[n] * v;
    p.chamber_lost[i] = pa * x[kHeadRelief + n] + pb * x[kRodRelief + n] + (pa - pb) * detail.leakage[i];
    p.piston_out[i] = detail.pin_N[n] * detail.pose.lever_m[n] * x[kRate + n];
    p.piston_lost[i] = detail.bristle_loss_W[n] + detail.pin_loss_W[n] -
                       (detail.stop_force[n] - model.stop_spring(i, detail.length_m[n])) * v;
    p.joint_stop_lost -= (detail.joint_stop_torque[n] - model.joint_stop_spring(i, x[kAngle + n])) * x[kRate + n];
  }
  p.contact = detail.contact.power_W(detail.bucket);
  p.ground_lost = detail.ground.lost_W;
  return p;
}

void Plant::Impl::account(const Powers& now, double h) noexcept {
  const auto add = [h](double& sum, double before, double after) { sum += 0.5 * h * (before + after); };
  EnergyLedger& e = state.energy;
  add(e.pump.in, last.pump_in, now.pump_in);
  add(e.pump.out, last.pump_out, now.pump_out);
  add(e.pump.lost, last.pump_lost, now.pump_lost);
  for (std::size_t i = 0; i < kJoints; ++i) {
    add(e.valve[i].in, last.valve_in[i], now.valve_in[i]);
    add(e.valve[i].out, last.valve_out[i], now.valve_out[i]);
    add(e.valve[i].lost, last.valve_lost[i], now.valve_lost[i]);
    add(e.chambers[i].in, last.chamber_in[i], now.chamber_in[i]);
    add(e.chambers[i].out, last.chamber_out[i], now.chamber_out[i]);
    add(e.chambers[i].lost, last.chamber_lost[i], now.chamber_lost[i]);
    add(e.piston[i].in, last.chamber_out[i], now.chamber_out[i]);
    add(e.piston[i].out, last.piston_out[i], now.piston_out[i]);
    add(e.piston[i].lost, last.piston_lost[i], now.piston_lost[i]);
    add(e.links.in, last.piston_out[i], now.piston_out[i]);
  }
  add(e.links.out, -last.contact, -now.contact);
  add(e.links.lost, last.joint_stop_lost + last.ground_lost, now.joint_stop_lost + now.ground_lost);
  add(e.contact.in, -last.contact, -now.contact);
  add(state.valve_work_J, last.valve_work, now.valve_work);
  last = now;
}

void Plant::Impl::publish() noexcept {
  const Turn& hull = detail.hull.turn;
  const HydraulicsDescription& hydraulics = model.truth().machine.hydraulics;
  state.t_s = static_cast<double>(substeps) * kSubstep_s;
  state.joint_rad = x.segment<3>(kAngle);
  state.joint_radps = x.segment<3>(kRate);
  state.joint_radps2 = detail.acceleration;
  state.cylinder_m = detail.length_m;
  state.cylinder_mps = detail.speed;
  state.lever_m = detail.pose.lever_m;
  state.cylinder_N = detail.pressure_force;
  state.friction_N = detail.friction;
  const double hose = hydraulics.hose_drop_Pa_per_m3ps * model.viscosity();
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    state.spool[n] = spools[i].position();
    state.opening[n] = held.opening[i];
    state.chamber_Pa[2 * i] = x[kHead + n];
    state.chamber_Pa[2 * i + 1] = x[kRod + n];
    // The valve's drop includes the hose's: the transmitter sits between them.
    state.transmitter_Pa[2 * i] = x[kHead + n] + hose * detail.head_flow[i];
    state.transmitter_Pa[2 * i + 1] = x[kRod + n] + hose * detail.rod_flow[i];
  }
  state.tip_m = RigidBody::tip(detail.pose);
  state.tip_mps = RigidBody::tip_rate(detail.pose, state.joint_radps);
  state.tip_world_m = detail.hull.pin_m + hull * state.tip_m;
  state.contact_N = hull.back(detail.contact.sum());
  state.contact_m = detail.contact.weight_N > 0
                        ? detail.bucket.turn.back(detail.contact.weighted_Nm) / detail.contact.weight_N
                        : PlanarVector(PlanarVector::Zero());
  state.wall_N = hull.back(detail.contact.wall);
  state.soil_N = hull.back(detail.contact.soil);
  state.pipe_N = hull.back(detail.contact.pipe);
  state.payload_kg = held.load.mass_kg;
  state.weight_N = hull.back(PlanarVector(0, -kGravity_mps2 * held.load.mass_kg));
  state.payload_m =
      held.load.mass_kg > 0 ? PlanarVector(held.load.first_kgm / held.load.mass_kg) : PlanarVector::Zero();
  state.warmth_K = warmth_K;
  state.pump_Pa = x[kPump];
  state.pump_m3ps = detail.pump_flow;
  const double asked = detail.pump_at_limit ? model.asked_flow(x, held) : 0;
  state.pump_share = asked > 0 ? std::min(1.0, (detail.feed[0] + detail.feed[1] + detail.feed[2]) / asked) : 1;
  state.tilt_hull_rad = model.truth().hull_pitch_rad + x[kHull + 1];
  state.hull_heave_m = x[kHull];
  state.hull_pitch_rad = x[kHull + 1];
  state.track_N = detail.ground.push_N;
  // Specific force at the boom's middle, in boom axes; at rest its direction is the boom's slope.
  const PlanarVector half = 0.5 * detail.pose.boom_m;
  const double turning = detail.hull.rate_radps + state.joint_radps[0];
  const double turning_radps2 = detail.hull.rate_radps2 + detail.acceleration[0];
  const PlanarVector felt =
      detail.pose.boom.back(detail.hull.lift_mps2 + turning_radps2 * perp(half) - turning * turning * half);
  state.tilt_boom_rad = std::atan2(felt.x(), felt.y());
  publish_stored();
  state.events = world.events();
}

void Plant::Impl::publish_stored() noexcept {
  EnergyLedger& e = state.energy;
  e.pump.stored = kPumpVolume_m3 * model.oil().energy_density(x[kPump]);
  e.links.stored = model.mechanical_energy(x, detail, held.load);
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    const double length = detail.length_m[n];
    e.chambers[i].stored = model.head_volume(i, length) * model.oil().energy_density(x[kHead + n]) +
                           model.rod_volume(i, length) * model.oil().energy_density(x[kRod + n]);
    e.piston[i].stored =
        model.bristle_energy(i, x[kBristle + n]) + model.stop_energy(i, length) + model.pin_energy(x, detail.pose, i);
    e.links.stored += model.joint_stop_energy(i, state.joint_rad[n]);
  }
}

Plant::Plant(const MachineTruth& truth, const WorldDescription& world, const JointVector& start_rad)
    : impl_(std::make_unique<Impl>(truth, world, start_rad)) {}
Plant::~Plant() = default;
Plant::Plant(Plant&&) noexcept = default;
Plant& Plant::operator=(Plant&&) noexcept = default;

void Plant::set_valve_demand(int joint, double demand) noexcept {
  impl_->spools[static_cast<std::size_t>(joint)].demand(std::isfinite(demand) ? std::clamp(demand, -1.0, 1.0) : 0);
}

void Plant::set_pilot(bool energised) noexcept {
  impl_->pilot = energised;
}

void Plant::set_pull(const PlanarVector& force_N) noexcept {
  set_pull(force_N, PlanarVector(truth().machine.links[kBucket].length_m, 0));
}

void Plant::set_pull(const PlanarVector& force_N, const PlanarVector& at_m) noexcept {
  impl_->pull_N = force_N.allFinite() && at_m.allFinite() ? force_N : PlanarVector::Zero();
  impl_->pull_at_m = at_m.allFinite() ? at_m : PlanarVector::Zero();
}

void Plant::hang(double mass_kg) {
  impl_->world.hang(mass_kg, impl_->state.t_s);
}

void Plant::step(Duration tick) noexcept {
  impl_->tick(std::llround(to_seconds(tick) / kSubstep_s));
}

const PlantState& Plant::state() const noexcept {
  return impl_->state;
}
const MachineTruth& Plant::truth() const noexcept {
  return impl_->model.truth();
}

}  // namespace knuckle::sim
