// The plant's equations stepped as the plant steps them, with the state vector open to look at: how fast they are
// bounds the fixed step. Spools are left out: openings jump, which is harder on the step than any spool.
#pragma once

#include <Eigen/Eigenvalues>

#include "sim/plant_model.h"
#include "sim/world_model.h"

namespace knuckle::sim {

class ModelRun {
 public:
  ModelRun(const MachineTruth& truth, const WorldDescription& world, const JointVector& start_rad)
      : model_(truth), world_(world, truth.machine) {
    x_ = model_.equilibrium(start_rad, held_.load);
    (void)model_.derivative(x_, held_, world_, detail_);
  }

  void open(const JointVector& valves) { std::copy(valves.begin(), valves.end(), held_.opening.begin()); }

  void run(double seconds) {
    constexpr double h = kSubstep_s;
    for (auto left = std::lround(seconds / h); left > 0; --left) {
      const StateVector k1 = model_.derivative(x_, held_, world_, detail_);
      const StateVector k2 = model_.derivative(x_ + h / 2 * k1, held_, world_, detail_);
      const StateVector k3 = model_.derivative(x_ + h / 2 * k2, held_, world_, detail_);
      const StateVector k4 = model_.derivative(x_ + h * k3, held_, world_, detail_);
      x_ += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      t_s_ += h;
      (void)model_.derivative(x_, held_, world_, detail_);
      if (world_.advance(t_s_, h, model_.bucket_motion(x_, detail_.pose))) held_.load = world_.load();
      if (!world_.empty()) world_.set_mobility(model_.mobility(detail_), detail_.bucket);
    }
  }

  [[nodiscard]] double t_s() const { return t_s_; }
  [[nodiscard]] double wall_N() const { return detail_.contact.wall.norm(); }

  /// Largest |eigenvalue| of the numerical Jacobian times the step; Runge and Kutta's is sound below 2.7.
  [[nodiscard]] double step_times_fastest_pole() const {
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
      StateVector low = x_, high = x_;
      low[j] -= scale[j];
      high[j] += scale[j];
      const StateVector slope =
          (model_.derivative(high, held_, world_, scratch) - model_.derivative(low, held_, world_, scratch)) /
          (2 * scale[j]);
      jacobian.col(j) = slope.head<kStates>();
    }
    // Rows and columns to like size, so that the eigenvalue solver sees no pascals beside radians.
    const Eigen::Matrix<double, kStates, 1> size = scale.head<kStates>();
    const Jacobian scaled = size.cwiseInverse().asDiagonal() * jacobian * size.asDiagonal();
    return kSubstep_s * Eigen::EigenSolver<Jacobian>(scaled, false).eigenvalues().cwiseAbs().maxCoeff();
  }

 private:
  PlantModel model_;
  WorldModel world_;
  HeldInputs held_;
  PlantDetail detail_;
  StateVector x_;
  double t_s_ = 0;
};

}  // namespace knuckle::sim
