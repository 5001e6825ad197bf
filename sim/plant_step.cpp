// The plant's step: Runge and Kutta's of fourth order with the fast decays of chamber pressures, bristles and pump
// taken out by their exponentials (ETDRK4-B: Krogstad, Generalized integrating factor methods for stiff PDEs, J.
// Comput. Phys. 203 (2005), 72-88). Levers and moments of mass are computed twice a step, in its middle and at its end,
// and kept for the evaluation next to it, whose angles differ by h^2/4 of an acceleration: an error of third order in
// h, of a millionth of the lever at 10 rad/s^2 and a millisecond.
#include <cmath>

#include "sim/plant_model.h"

namespace knuckle::sim {
namespace {

/// phi_1(c) = (e^c - 1) / c and so on, phi_n+1 = (phi_n - 1/n!) / c.
struct Phi {
  double first = 1, second = 0.5, third = 1.0 / 6;
  Phi() = default;
  explicit Phi(double c) noexcept {
    constexpr double kSmall = 0.2;
    if (std::abs(c) < kSmall) {  // the quotients would be differences of like numbers
      third = 1.0 / 6 + c * (1.0 / 24 + c * (1.0 / 120 + c * (1.0 / 720 + c * (1.0 / 5040 + c / 40320))));
      second = 0.5 + c * third;
      first = 1 + c * second;
    } else {
      first = (std::exp(c) - 1) / c;
      second = (first - 1) / c;
      third = (second - 0.5) / c;
    }
  }
  /// At 2 c, from those at c. Nothing cancels: 1 + c first / 2 is (e^c + 1) / 2.
  [[nodiscard]] Phi doubled(double c) const noexcept {
    Phi twice;
    twice.first = first * (1 + 0.5 * c * first);
    twice.second = 0.25 * first * first + 0.5 * second;
    twice.third = 0.125 * second * (first + 1) + 0.25 * third;
    return twice;
  }
};

}  // namespace

PlantModel::Decays PlantModel::decays(const StateVector& x, const HeldInputs& held,
                                      const PlantDetail& detail) const noexcept {
  const HydraulicsDescription& h = truth_.machine.hydraulics;
  Decays decays;
  double feed_loss = 0;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    const double pa = x[kHead + n], pb = x[kRod + n], o = held.opening[i], length = detail.length_m[n];
    const double leakage = thinner_ * truth_.valve[i].leakage_m3ps_per_Pa;
    double head_loss = leakage + (pa < h.tank_Pa ? suck_gain_ : 0);
    double rod_loss = leakage + (pb < h.tank_Pa ? suck_gain_ : 0);
    if (o != 0) {
      const double gain = axes_[i].valve_gain * std::abs(o) * left_by_others(i, held);
      const double fed = o > 0 ? pa : pb, emptied = o > 0 ? pb : pa;
      const double feed = x[kPump] > fed ? gain * orifice_slope(x[kPump] - fed) : 0;
      (o > 0 ? head_loss : rod_loss) += feed;
      (o > 0 ? rod_loss : head_loss) += gain * orifice_slope(emptied - h.tank_Pa);
      feed_loss += feed;
    }
    decays[i] = -oil_.pressure_rate(pa, head_loss, head_volume(i, length));
    decays[kJoints + i] = -oil_.pressure_rate(pb, rod_loss, rod_volume(i, length));
    decays[2 * kJoints + i] = -detail.bristle_decay_1ps[n];
    const PinTruth& pin = truth_.pin[i];
    decays[3 * kJoints + 1 + i] = pin.compliant() ? -detail.rod_damping_Ns_per_m[n] / pin.mass_kg : 0;
  }
  const double regulator = detail.pump_flow > 0 && !detail.pump_at_limit ? regulator_gain_ : 0;
  const double relief = x[kPump] > h.main_relief_Pa ? main_relief_gain_ : 0;
  decays[3 * kJoints] = -oil_.pressure_rate(x[kPump], feed_loss + regulator + relief, kPumpVolume_m3);
  return decays;
}

StateVector PlantModel::stepped(const StateVector& x, const StateVector& slope, PlantDetail& detail,
                                const HeldInputs& held, const WorldModel& world, double h) const noexcept {
  StateVector rate = StateVector::Zero();
  StateVector half1 = StateVector::Ones(), half2 = StateVector::Constant(0.5);
  StateVector whole1 = half1, whole2 = half2, whole3 = StateVector::Constant(1.0 / 6);
  const Decays decay = decays(x, held, detail);
  constexpr Eigen::Index kPumpAt = 3 * kJoints;
  for (std::size_t i = 0; i < decay.size(); ++i) {
    if (decay[i] == 0) continue;
    const auto n = static_cast<Eigen::Index>(i);
    const Eigen::Index at = n < kPumpAt    ? kHead + n
                            : n == kPumpAt ? Eigen::Index{kPump}
                                           : kRodEndRate + n - kPumpAt - 1;
    const double c = h / 2 * decay[i];
    const Phi half(c), whole = half.doubled(c);
    rate[at] = decay[i];
    half1[at] = half.first;
    half2[at] = half.second;
    whole1[at] = whole.first;
    whole2[at] = whole.second;
    whole3[at] = whole.third;
  }
  const auto rest = [&](const StateVector& at, Geometry geometry) {
    return StateVector(derivative(at, held, world, detail, geometry) - rate.cwiseProduct(at));
  };
  const StateVector n1 = slope - rate.cwiseProduct(x);
  const StateVector middle = x + h / 2 * half1.cwiseProduct(slope);
  const StateVector n2 = rest(middle, Geometry::kNew);
  const StateVector n3 = rest(middle + h * half2.cwiseProduct(n2 - n1), Geometry::kNear);
  const StateVector end = x + h * whole1.cwiseProduct(slope);
  const StateVector n4 = rest(end + 2 * h * whole2.cwiseProduct(n3 - n1), Geometry::kNew);
  return end + h * (whole2.cwiseProduct(2 * (n2 + n3) - 3 * n1 - n4) + 4 * whole3.cwiseProduct(n1 - n2 - n3 + n4));
}

}  // namespace knuckle::sim
