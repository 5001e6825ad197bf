#include "sim/plant.h"

#include <algorithm>
#include <cmath>

#include "sim/plant_model.h"
#include "sim/spool.h"

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
  double tip = 0, joint_stop_lost = 0, valve_work = 0;
};

}  // namespace

struct Plant::Impl {
  Impl(const MachineTruth& truth, const WorldDescription& description, const JointVector& start_rad)
      : model(truth),
        world(description, truth.machine.payload_com_m),
        spools{Spool(truth.machine.cylinders[0].valve, kSubstep_s), Spool(truth.machine.cylinders[1].valve, kSubstep_s),
               Spool(truth.machine.cylinders[2].valve, kSubstep_s)} {
    x.setZero();
    x.segment<3>(kAngle) = start_rad;
    detail.pose = model.body().pose(start_rad);
    world.advance(0, 0, bucket_motion());  // hangs the weights that are there from the start
    held.load = world.load();
    x = model.equilibrium(start_rad, held.load);
    slope = model.derivative(x, held, world, detail);
    last = powers();
    refresh_mobility();
    publish();
  }
  void tick(std::int64_t count) noexcept {
    for (std::int64_t i = 0; i < count; ++i) substep();
    refresh_mobility();
    publish();
  }

  void substep() noexcept;
  void refresh_mobility() noexcept;
  [[nodiscard]] BucketMotion bucket_motion() const noexcept;
  [[nodiscard]] Powers powers() const noexcept;
  void account(const Powers& now) noexcept;
  void publish() noexcept;
  void publish_stored() noexcept;

  PlantModel model;
  WorldModel world;
  PerJoint<Spool> spools;
  bool pilot = false;
  PlanarVector tip_load_N = PlanarVector::Zero();
  std::int64_t substeps = 0;
  StateVector x, slope;  // slope: derivative at x with the present inputs
  HeldInputs held;
  PlantDetail detail;  // belongs to slope
  Powers last;
  PlantState state;
};

BucketMotion Plant::Impl::bucket_motion() const noexcept {
  const Turn& hull = model.body().hull();
  const JointVector angle = x.segment<3>(kAngle), rate = x.segment<3>(kRate);
  const Turn bucket = hull * detail.pose.bucket;
  return {hull * RigidBody::tip(detail.pose),
          hull * RigidBody::tip_rate(detail.pose, rate),
          {bucket.c, bucket.s},
          angle.sum() + model.truth().hull_pitch_rad,
          rate.sum()};
}

void Plant::Impl::substep() noexcept {
  constexpr double h = kSubstep_s;
  PlantDetail scratch;
  const StateVector k2 = model.derivative(x + (h / 2) * slope, held, world, scratch);
  const StateVector k3 = model.derivative(x + (h / 2) * k2, held, world, scratch);
  const StateVector k4 = model.derivative(x + h * k3, held, world, scratch);
  x += (h / 6) * (slope + 2 * (k2 + k3) + k4);
  ++substeps;

  for (std::size_t i = 0; i < kJoints; ++i) {
    spools[i].advance(pilot);
    held.opening[i] = spools[i].opening();
  }
  held.tip_load_N = tip_load_N;
  slope = model.derivative(x, held, world, detail);
  if (world.advance(static_cast<double>(substeps) * h, h, bucket_motion())) {
    held.load = world.load();
    slope = model.derivative(x, held, world, detail);
  }
  account(powers());
}

void Plant::Impl::refresh_mobility() noexcept {
  Eigen::Matrix2d mobility;
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const PlanarVector push = model.body().hull().back(PlanarVector::Unit(axis));
    const JointVector motion = detail.mass.solve(RigidBody::tip_torque(detail.pose, push));
    mobility.col(axis) = model.body().hull() * RigidBody::tip_rate(detail.pose, motion);
  }
  world.set_mobility(mobility);
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
    p.chamber_lost[i] = pa * x[kHeadRelief + n] + pb * x[kRodRelief + n];
    p.piston_out[i] = (detail.pressure_force[n] - detail.friction[n] + detail.stop_force[n]) * v;
    p.piston_lost[i] =
        detail.bristle_loss_W[n] - (detail.stop_force[n] - model.stop_spring(i, detail.pose.length_m[n])) * v;
    p.joint_stop_lost -= (detail.joint_stop_torque[n] - model.joint_stop_spring(i, x[kAngle + n])) * x[kRate + n];
  }
  p.tip = detail.tip_force.dot(detail.tip_rate);
  return p;
}

void Plant::Impl::account(const Powers& now) noexcept {
  const auto add = [](double& sum, double before, double after) { sum += 0.5 * kSubstep_s * (before + after); };
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
  add(e.links.out, -last.tip, -now.tip);
  add(e.links.lost, last.joint_stop_lost, now.joint_stop_lost);
  add(e.contact.in, -last.tip, -now.tip);
  add(state.valve_work_J, last.valve_work, now.valve_work);
  last = now;
}

void Plant::Impl::publish() noexcept {
  const Turn& hull = model.body().hull();
  const HydraulicsDescription& hydraulics = model.truth().machine.hydraulics;
  state.t_s = static_cast<double>(substeps) * kSubstep_s;
  state.joint_rad = x.segment<3>(kAngle);
  state.joint_radps = x.segment<3>(kRate);
  state.joint_radps2 = detail.acceleration;
  state.cylinder_m = detail.pose.length_m;
  state.cylinder_mps = detail.speed;
  state.lever_m = detail.pose.lever_m;
  state.cylinder_N = detail.pressure_force;
  state.friction_N = detail.friction;
  const double hose = hydraulics.hose_drop_Pa_per_m3ps * model.truth().viscosity_factor;
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
  state.tip_m = detail.tip;
  state.tip_mps = detail.tip_rate;
  state.tip_world_m = hull * detail.tip;
  state.tip_N = detail.tip_force;
  state.wall_N = hull.back(detail.contact.wall);
  state.soil_N = hull.back(detail.contact.soil);
  state.pipe_N = hull.back(detail.contact.pipe);
  state.payload_kg = held.load.mass_kg;
  state.payload_m =
      held.load.mass_kg > 0 ? PlanarVector(held.load.first_kgm / held.load.mass_kg) : PlanarVector::Zero();
  state.pump_Pa = x[kPump];
  state.pump_m3ps = detail.pump_flow;
  const double asked = detail.pump_at_limit ? model.asked_flow(x, held) : 0;
  state.pump_share = asked > 0 ? std::min(1.0, (detail.feed[0] + detail.feed[1] + detail.feed[2]) / asked) : 1;
  state.tilt_hull_rad = model.truth().hull_pitch_rad;
  // Specific force at the boom's middle, in boom axes; at rest its direction is the boom's slope.
  const PlanarVector half = 0.5 * detail.pose.boom_m;
  const PlanarVector felt = detail.pose.boom.back(model.body().lift_mps2() + detail.acceleration[0] * perp(half) -
                                                  state.joint_radps[0] * state.joint_radps[0] * half);
  state.tilt_boom_rad = std::atan2(felt.x(), felt.y());
  publish_stored();
  state.events = world.events();
}

void Plant::Impl::publish_stored() noexcept {
  EnergyLedger& e = state.energy;
  e.pump.stored = kPumpVolume_m3 * model.oil().energy_density(x[kPump]);
  e.links.stored =
      detail.mass.kinetic_energy(state.joint_radps) + model.body().potential_energy(detail.pose, held.load);
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    const double length = detail.pose.length_m[n];
    e.chambers[i].stored = model.head_volume(i, length) * model.oil().energy_density(x[kHead + n]) +
                           model.rod_volume(i, length) * model.oil().energy_density(x[kRod + n]);
    e.piston[i].stored = model.bristle_energy(i, x[kBristle + n]) + model.stop_energy(i, length);
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

void Plant::set_tip_load(const PlanarVector& force_N) noexcept {
  impl_->tip_load_N = force_N.allFinite() ? force_N : PlanarVector::Zero();
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
