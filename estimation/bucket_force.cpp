#include "estimation/bucket_force.h"

#include <algorithm>
#include <cmath>

#include "estimation/tip_force.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr double kTeeth_m = 0.02;     // a contact at the tip is somewhere along the teeth
constexpr double kBeyondChance2 = 4;  // squared sigmas of couple from which on it is taken for one

}  // namespace

BucketForceModel::BucketForceModel(const MachineDescription& machine) noexcept {
  const PlanarVector tip(machine.links[kBucket].length_m, 0);
  const BucketProfile& profile = machine.bucket_profile;
  from_tip_m_ = {profile.edge_m - tip, profile.heel_m - tip, profile.back_m - tip, profile.cheek_m - tip,
                 PlanarVector(-tip)};
}

BucketForce BucketForceModel::solve(const JointVector& joints_rad, const Eigen::Matrix<double, 2, 3>& jacobian,
                                    const JointVector& torque_Nm,
                                    const Eigen::Matrix3d& covariance_Nm2) const noexcept {
  const TipForce at_tip = solve_tip_force(jacobian, torque_Nm, covariance_Nm2);
  // The couple that fits best with the force free to follow: c = u'W r / (u'W u - u'W J' S J W u), r the residual.
  const JointVector u = JointVector::Ones();
  const JointVector wu = covariance_Nm2.ldlt().solve(u);
  const PlanarVector follows = at_tip.covariance_N2 * (jacobian * wu);  // force at the tip per couple
  const double information = wu.dot(u - jacobian.transpose() * follows);
  const JointVector left = torque_Nm - jacobian.transpose() * at_tip.force_N;
  const double fit_Nm = information > 0 ? wu.dot(left) / information : 0;

  // The couples that this force has where its line passes through the bucket.
  const PlanarVector free_N = at_tip.force_N - fit_Nm * follows;
  const Eigen::Rotation2Dd to_machine(joints_rad.sum());
  double least = 0, most = 0;
  for (const PlanarVector& corner : from_tip_m_) {
    const double couple = cross(to_machine * corner, free_N);
    least = std::min(least, couple), most = std::max(most, couple);
  }
  const double possible_Nm = std::clamp(fit_Nm, least, most);
  const double shown2 = possible_Nm * possible_Nm;
  const double chance2 = information > 0 ? kBeyondChance2 / information : 1;
  const double floor_Nm = kTeeth_m * free_N.norm();

  BucketForce result;
  result.residual_sigma = std::abs(fit_Nm - possible_Nm) * std::sqrt(std::max(0.0, information));
  const double prior2 = floor_Nm * floor_Nm + shown2 * shown2 / (shown2 + chance2);
  const Eigen::Matrix3d with_couple = covariance_Nm2 + prior2 * u * u.transpose();
  const TipForce best = solve_tip_force(jacobian, torque_Nm, with_couple);
  result.force_N = best.force_N;
  result.covariance_N2 = best.covariance_N2;
  const JointVector rest = torque_Nm - jacobian.transpose() * best.force_N;
  result.couple_Nm = prior2 * u.dot(with_couple.ldlt().solve(rest));
  return result;
}

}  // namespace knuckle::estimation
