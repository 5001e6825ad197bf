// How fast the plant's equations are at a state: what bounds the fixed step.
#include <Eigen/Eigenvalues>

#include "sim/plant_model.h"

namespace knuckle::sim {

double fastest_pole(const PlantModel& model, const StateVector& x, const HeldInputs& held, const WorldModel& world) {
  using Jacobian = Eigen::Matrix<double, kStates, kStates>;
  StateVector scale = StateVector::Ones();
  scale.segment<3>(kAngle).setConstant(1e-7);
  scale.segment<3>(kRate).setConstant(1e-6);
  scale.segment<6>(kHead).setConstant(10);
  scale.segment<3>(kBristle).setConstant(1e-9);
  scale.segment<6>(kHeadRelief).setConstant(1e-9);
  scale.segment<2>(kPump).setConstant(10);
  Jacobian jacobian;
  PlantDetail scratch;
  for (Eigen::Index j = 0; j < kStates; ++j) {
    StateVector low = x, high = x;
    low[j] -= scale[j];
    high[j] += scale[j];
    const StateVector slope =
        (model.derivative(high, held, world, scratch) - model.derivative(low, held, world, scratch)) / (2 * scale[j]);
    jacobian.col(j) = slope.head<kStates>();
  }
  // Rows and columns to like size, so that the eigenvalue solver sees no pascals beside radians.
  const Eigen::Matrix<double, kStates, 1> size = scale.head<kStates>();
  const Jacobian scaled = size.cwiseInverse().asDiagonal() * jacobian * size.asDiagonal();
  return Eigen::EigenSolver<Jacobian>(scaled, false).eigenvalues().cwiseAbs().maxCoeff();
}

}  // namespace knuckle::sim
