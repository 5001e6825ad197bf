#include "app/studies/error_sources.h"

namespace knuckle::studies {
namespace {

void take_geometry(const MachineDescription& from, MachineDescription& to) {
  for (std::size_t i = 0; i < kJoints; ++i) to.links[i].length_m = from.links[i].length_m;
  to.boom_mount = from.boom_mount;
  to.arm_mount = from.arm_mount;
  const BucketLinkage masses = to.bucket_linkage;
  to.bucket_linkage = from.bucket_linkage;
  to.bucket_linkage.rocker_mass_kg = masses.rocker_mass_kg;
  to.bucket_linkage.coupler_mass_kg = masses.coupler_mass_kg;
}

void take_masses(const MachineDescription& from, MachineDescription& to) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    to.links[i].mass_kg = from.links[i].mass_kg;
    to.links[i].inertia_kgm2 = from.links[i].inertia_kgm2;
    to.cylinders[i].body_mass_kg = from.cylinders[i].body_mass_kg;
    to.cylinders[i].rod_mass_kg = from.cylinders[i].rod_mass_kg;
  }
  to.bucket_linkage.rocker_mass_kg = from.bucket_linkage.rocker_mass_kg;
  to.bucket_linkage.coupler_mass_kg = from.bucket_linkage.coupler_mass_kg;
}

}  // namespace

sim::MachineTruth with_only(const MachineDescription& nominal, const sim::MachineTruth& sampled, ErrorSource source) {
  sim::MachineTruth truth = sim::nominal_truth(nominal);
  switch (source) {
    case ErrorSource::kNone:
      break;
    case ErrorSource::kGeometry:
      take_geometry(sampled.machine, truth.machine);
      break;
    case ErrorSource::kMasses:
      take_masses(sampled.machine, truth.machine);
      break;
    case ErrorSource::kFriction:
      truth.friction = sampled.friction;
      break;
    case ErrorSource::kTransmitters:
      truth.pressure = sampled.pressure;
      break;
    case ErrorSource::kSlope:
      truth.hull_pitch_rad = sampled.hull_pitch_rad;
      truth.tilt_offset_rad = sampled.tilt_offset_rad;
      break;
    case ErrorSource::kEncoders:
      truth.encoder_offset_m = sampled.encoder_offset_m;
      truth.encoder_noise_m = sampled.encoder_noise_m;
      break;
    case ErrorSource::kValves:
      for (std::size_t i = 0; i < kJoints; ++i) {
        truth.machine.cylinders[i].valve = sampled.machine.cylinders[i].valve;
      }
      truth.machine.hydraulics.bulk_modulus_Pa = sampled.machine.hydraulics.bulk_modulus_Pa;
      break;
    case ErrorSource::kOil:
      truth.viscosity_factor = sampled.viscosity_factor;
      break;
  }
  return truth;
}

}  // namespace knuckle::studies
