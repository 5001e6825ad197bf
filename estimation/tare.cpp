// Priors and the sequential update of the tare's Kalman filter.
#include "estimation/tare.h"

#include <algorithm>
#include <cmath>

namespace knuckle::estimation {
namespace {

// What may be wrong with a nominal machine (standard deviations).
constexpr double kPressureOffset_Pa = 0.6e5;  // +-1 bar, evenly spread
constexpr double kCoulombPart = 0.2;          // +-30 %, evenly spread
constexpr double kViscousPart = 0.25;         // friction +-30 % and the oil's temperature
constexpr double kMassPart = 0.04;            // +-5 %, and what sits on the links that no drawing shows
constexpr double kComPart = 0.02;             // of the link length
// Drift while running: seals and oil warm up, transmitters creep.
constexpr double kBiasWalk_N = 1.0;          // per square root of a second
constexpr double kFrictionWalkPart = 0.002;  // likewise

}  // namespace

Tare::Tare(const MachineDescription& machine) {
  for (int i = 0; i < kJoints; ++i) {
    const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
    const double bias = kPressureOffset_Pa * std::hypot(cylinder.head_area_m2(), cylinder.rod_side_area_m2());
    const double coulomb = kCoulombPart * cylinder.friction.coulomb_N;
    const double viscous = kViscousPart * cylinder.friction.viscous_Ns_per_m;
    p_(kTareBias + i, kTareBias + i) = bias * bias;
    p_(kTareCoulomb + i, kTareCoulomb + i) = coulomb * coulomb;
    p_(kTareViscous + i, kTareViscous + i) = viscous * viscous;
    walk_[kTareBias + i] = kBiasWalk_N * kBiasWalk_N;
    walk_[kTareCoulomb + i] = std::pow(kFrictionWalkPart * cylinder.friction.coulomb_N, 2);
    walk_[kTareViscous + i] = std::pow(kFrictionWalkPart * cylinder.friction.viscous_Ns_per_m, 2);
  }
  // A mass error moves its own moments and, at the earlier links' full length, theirs: X and Z priors are correlated.
  for (int k = 0; k < kJoints; ++k) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(k)];
    TareVector per_mass = TareVector::Zero();
    for (int i = 0; i < k; ++i) per_mass[kTareX + i] = machine.links[static_cast<std::size_t>(i)].length_m;
    per_mass[kTareX + k] = link.com_m.x();
    per_mass[kTareZ + k] = link.com_m.y();
    p_ += std::pow(kMassPart * link.mass_kg, 2) * per_mass * per_mass.transpose();
    const double com = std::pow(kComPart * link.length_m * link.mass_kg, 2);
    p_(kTareX + k, kTareX + k) += com;
    p_(kTareZ + k, kTareZ + k) += com;
  }
  prior_ = p_.diagonal();
}

void Tare::predict(double duration_s) noexcept {
  for (int i = 0; i < kTareStates; ++i)
    if (p_(i, i) < prior_[i]) p_(i, i) += walk_[i] * duration_s;
}

void Tare::look(const TareSample& sample) noexcept {
  if (queued_ == kDelayedLooks) {
    learn(queue_[static_cast<std::size_t>(next_)]);
  } else {
    ++queued_;
  }
  queue_[static_cast<std::size_t>(next_)] = sample;
  next_ = (next_ + 1) % kDelayedLooks;
}

void Tare::learn(const TareSample& sample) noexcept {
  predict(kLookEvery_s);
  const TareColumns h = sample.signals.columns();
  for (int i = 0; i < kJoints; ++i) {
    const TareVector row = h.row(i).transpose();
    const TareVector ph = p_ * row;
    const double spread = row.dot(ph);
    const double innovation = -sample.residual_Nm[i] - row.dot(x_);
    // Huber: beyond 2.5 sigma an innovation counts only as much as 2.5 sigma would.
    const double ratio = std::abs(innovation) / (2.5 * std::sqrt(spread + sample.variance_Nm2[i]));
    const double variance = sample.variance_Nm2[i] * std::max(1.0, ratio);
    const TareVector gain = ph / (spread + variance);
    x_ += gain * innovation;
    p_ -= gain * ph.transpose();
  }
  p_ = 0.5 * (p_ + p_.transpose()).eval();
  learned_s_ += kLookEvery_s;
}

}  // namespace knuckle::estimation
