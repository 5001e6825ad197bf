#include "estimation/tip_force.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <numbers>

#include "core/units.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

Eigen::Matrix3d torque_weight(const Eigen::Matrix3d& covariance_Nm2) noexcept {
  if (all_torques_known(covariance_Nm2)) return covariance_Nm2.inverse();
  Eigen::Matrix3d known = Eigen::Matrix3d::Identity();
  for (int i = 0; i < kJoints; ++i)
    for (int j = 0; j < kJoints; ++j)
      if (torque_known(covariance_Nm2, i) && torque_known(covariance_Nm2, j)) known(i, j) = covariance_Nm2(i, j);
  Eigen::Matrix3d weight = known.inverse();
  for (int i = 0; i < kJoints; ++i)
    if (!torque_known(covariance_Nm2, i)) weight(i, i) = 0;
  return weight;
}

TipForce solve_tip_force(const PlanarJacobian& jacobian, const JointVector& torque_Nm,
                         const Eigen::Matrix3d& covariance_Nm2) noexcept {
  const Eigen::Matrix3d weight = torque_weight(covariance_Nm2);
  const PlanarJacobian jw = jacobian * weight;
  const double prior_N = all_torques_known(covariance_Nm2) ? kForcePrior_N : kForcePriorOfTwo_N;
  const Eigen::Matrix2d information = jw * jacobian.transpose() + Eigen::Matrix2d::Identity() / (prior_N * prior_N);
  TipForce result;
  result.covariance_N2 = information.inverse();
  result.force_N = result.covariance_N2 * (jw * torque_Nm);
  const JointVector left = torque_Nm - jacobian.transpose() * result.force_N;
  result.residual_sigma = std::sqrt(std::max(0.0, left.dot(weight * left)));
  return result;
}

namespace {

/// torque_weight() times the torques.
JointVector weighed(const Eigen::Matrix3d& covariance_Nm2, const JointVector& torque_Nm) noexcept {
  if (all_torques_known(covariance_Nm2)) return covariance_Nm2.ldlt().solve(torque_Nm);
  return torque_weight(covariance_Nm2) * torque_Nm;
}

constexpr double kTeeth_m = 0.02;     // a contact at the tip is somewhere along the teeth
constexpr double kBeyondChance2 = 4;  // squared sigmas of couple from which on it is taken for one

// Of touches before anything is known: mostly tip; never the pin, which is the arm's end; and something pointed may
// meet the outline between its corners.
constexpr double kTipShare = 2, kCornerShare = 1, kAnywhereShare = 0.3;
// Friction turns a push off the normal by 20 deg (0.36) or so; what hooks or is caught may pull any way.
constexpr double kFriction_rad = 20 * kDegree;
constexpr double kHookedShare = 0.05;

constexpr std::size_t kTipCorner = 0, kPinCorner = 4;
constexpr double kLeastSide_m = 1e-6;

double wrapped(double angle_rad) noexcept {
  return std::remainder(angle_rad, 2 * std::numbers::pi);
}

double log_size(const Eigen::Matrix2d& covariance_N2) noexcept {
  return 0.5 * std::log(covariance_N2.determinant());
}

/// Two torques tell a force at a corner that is in line with the arm only across it. Along it what they make of their
/// own noise is no force: there it is drawn to zero until it exceeds what it is told worse by than across. The interval
/// stays as wide, and wider by what was taken off.
TipForce shown(TipForce found) noexcept {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(found.covariance_N2);
  const PlanarVector worst = axes.eigenvectors().col(1);
  const double along_N = worst.dot(found.force_N), along2 = along_N * along_N;
  const double worse2 = axes.eigenvalues()[1] - axes.eigenvalues()[0];
  if (along2 == 0) return found;
  const double off_N = along_N * (1 - along2 / (along2 + kBeyondChance2 * worse2));
  found.force_N -= off_N * worst;
  found.covariance_N2 += off_N * off_N * worst * worst.transpose();
  return found;
}

}  // namespace

BucketForceModel::BucketForceModel(const MachineDescription& machine) noexcept {
  const std::array<PlanarVector, kCorners> outline = bucket_outline(machine);
  std::array<double, kCorners> normal_rad{};  // of the side from each corner to the next, counter-clockwise
  outlined_ = true;
  for (std::size_t i = 0; i < kCorners; ++i) {
    const PlanarVector side = outline[(i + 1) % kCorners] - outline[i];
    normal_rad[i] = std::atan2(-side.x(), side.y());
    outlined_ = outlined_ && side.norm() > kLeastSide_m;
  }
  for (const PlanarVector& corner : outline) middle_.from_tip_m += (corner - outline[kTipCorner]) / kCorners;
  for (std::size_t i = 0; i < kCorners; ++i) {
    const double before_rad = normal_rad[(i + kCorners - 1) % kCorners];
    const double range_rad = std::max(0.0, wrapped(normal_rad[i] - before_rad));
    const double share = i == kTipCorner ? kTipShare : i == kPinCorner ? 0 : kCornerShare;
    corners_[i] = {outline[i] - outline[kTipCorner], before_rad + range_rad / 2, range_rad / 2, share};
  }
}

BucketForceModel::Torques BucketForceModel::torques(const JointVector& joints_rad, const PlanarJacobian& jacobian,
                                                    const JointVector& torque_Nm,
                                                    const Eigen::Matrix3d& covariance_Nm2) const noexcept {
  return {Eigen::Rotation2Dd(joints_rad.sum()), jacobian, torque_Nm, covariance_Nm2, all_torques_known(covariance_Nm2)};
}

BucketForceModel::Answer BucketForceModel::at(const Corner& corner, const Torques& torques) const noexcept {
  const PlanarVector from_tip_m = torques.to_machine * corner.from_tip_m;
  const PlanarJacobian jacobian = beside_tip(torques.jacobian, from_tip_m);
  const TipForce solved = solve_tip_force(jacobian, torques.torque_Nm, torques.covariance_Nm2);
  const TipForce found = torques.all_known ? solved : shown(solved);
  Answer answer;
  const PlanarVector arm(-from_tip_m.y(), from_tip_m.x());  // torque about the tip = arm . force
  answer.load = {found.force_N,
                 found.covariance_N2,
                 arm.dot(found.force_N),
                 std::max(0.0, arm.dot(found.covariance_N2 * arm)),
                 found.covariance_N2 * arm,
                 0};

  // How far off the corner's normals a push against the force is, and how sure its direction is.
  const double size_N = std::max(1.0, found.force_N.norm());
  const PlanarVector across = PlanarVector(-found.force_N.y(), found.force_N.x()) / size_N;
  const double variance = kFriction_rad * kFriction_rad + across.dot(found.covariance_N2 * across) / (size_N * size_N);
  const PlanarVector push = torques.to_machine.inverse() * PlanarVector(-found.force_N);
  const double off_rad =
      std::max(0.0, std::abs(wrapped(std::atan2(push.y(), push.x()) - corner.normal_rad)) - corner.spread_rad);
  const double can_push = kHookedShare + (1 - kHookedShare) * std::exp(-0.5 * off_rad * off_rad / variance);
  answer.log_weight = std::log(corner.share * can_push);
  // Two torques explain a force at any place equally well. And small and large forces are equally likely there:
  // otherwise the places near the bucket's joint, where a force makes little torque, would outweigh all others.
  if (torques.all_known)
    answer.log_weight =
        answer.log_weight + log_size(found.covariance_N2) - 0.5 * found.residual_sigma * found.residual_sigma;
  return answer;
}

/// Couples that a force has where its line passes through the bucket: the least and the most.
std::pair<double, double> BucketForceModel::couples_Nm(const Eigen::Rotation2Dd& to_machine,
                                                       const PlanarVector& force_N) const noexcept {
  double least = 0, most = 0;
  for (const Corner& corner : corners_) {
    const double couple = cross(to_machine * corner.from_tip_m, force_N);
    least = std::min(least, couple);
    most = std::max(most, couple);
  }
  return {least, most};
}

/// The torque about the tip by the torques alone, evenly over the couples that the force can have: neither drawn to
/// zero for the force's sake nor to a corner. So its interval is that of its own force, which is not as sure as the one
/// that the corners help to find; what the two have in common is what the surer one leaves of it.
void BucketForceModel::add_torque(const Torques& torques, BucketLoad& load) const noexcept {
  const JointVector u = JointVector::Ones();
  const JointVector wu = weighed(torques.covariance_Nm2, u);
  const TipForce tip = solve_tip_force(torques.jacobian, torques.torque_Nm, torques.covariance_Nm2);
  const PlanarVector follows = tip.covariance_N2 * (torques.jacobian * wu);  // force at the tip per couple
  const double information = std::max(0.0, wu.dot(u - torques.jacobian.transpose() * follows));
  const auto [least, most] = couples_Nm(torques.to_machine, load.force_N);
  const double floor_Nm = kTeeth_m * load.force_N.norm();
  const double even = 1 / std::max(1e-9, floor_Nm * floor_Nm + (most - least) * (most - least) / 12);
  const JointVector left = torques.torque_Nm - torques.jacobian.transpose() * tip.force_N;
  load.torque_variance_N2m2 = 1 / (information + even);
  load.torque_Nm = (wu.dot(left) + even * 0.5 * (least + most)) * load.torque_variance_N2m2;
  const PlanarVector per_torque = -follows;
  const double own = per_torque.dot(load.covariance_N2.ldlt().solve(per_torque)) * load.torque_variance_N2m2;
  load.covariance_N2m = per_torque * load.torque_variance_N2m2 / std::max(1.0, own);
}

/// Solves J^T f + u c = torque, u = (1, 1, 1), with weights covariance^-1 and a prior of c around zero whose variance
/// is what the torques show of it (empirical Bayes), within the couples that f can have on the outline. Where a force
/// at the tip explains the torques the answer is that force; c costs no accuracy there.
BucketForceModel::AnyPlace BucketForceModel::anywhere(const Torques& torques) const noexcept {
  const auto& [to_machine, jacobian, torque_Nm, covariance_Nm2, all_known] = torques;
  AnyPlace any;
  if (!all_known) {  // of two torques there is a force for any place, and none that fits best
    any.answer = at(middle_, torques);
    any.answer.log_weight = std::log(kAnywhereShare);
    return any;
  }
  const TipForce at_tip = solve_tip_force(jacobian, torque_Nm, covariance_Nm2);
  // The couple that fits best with the force free to follow: c = u'W r / (u'W u - u'W J' S J W u), r the residual.
  const JointVector u = JointVector::Ones();
  const JointVector wu = weighed(covariance_Nm2, u);
  const PlanarVector follows = at_tip.covariance_N2 * (jacobian * wu);  // force at the tip per couple
  const double information = std::max(0.0, wu.dot(u - jacobian.transpose() * follows));
  const JointVector left = torque_Nm - jacobian.transpose() * at_tip.force_N;
  const double fit_Nm = information > 0 ? wu.dot(left) / information : 0;

  const PlanarVector free_N = at_tip.force_N - fit_Nm * follows;
  const auto [least, most] = couples_Nm(to_machine, free_N);
  const double possible_Nm = std::clamp(fit_Nm, least, most);
  const double shown2 = possible_Nm * possible_Nm;
  const double chance2 = information > 0 ? kBeyondChance2 / information : 1;
  const double floor_Nm = kTeeth_m * free_N.norm();
  const double residual_sigma = std::abs(fit_Nm - possible_Nm) * std::sqrt(information);

  BucketLoad& load = any.answer.load;
  const double prior2 = floor_Nm * floor_Nm + shown2 * shown2 / (shown2 + chance2);
  const Eigen::Matrix3d with_couple = covariance_Nm2 + prior2 * u * u.transpose();
  const TipForce best = solve_tip_force(jacobian, torque_Nm, with_couple);
  const JointVector rest = torque_Nm - jacobian.transpose() * best.force_N;
  any.couple_Nm = prior2 * u.dot(with_couple.ldlt().solve(rest));
  load = {best.force_N, best.covariance_N2, 0, 0, PlanarVector::Zero(), residual_sigma};
  // Couples are equally likely over their range; of that, the torques leave so much.
  const double seen_Nm = information > 0 ? std::sqrt(2 * std::numbers::pi / information) : most - least;
  const double kept = std::min(1.0, seen_Nm / std::max(1.0, most - least));
  any.answer.log_weight =
      std::log(kAnywhereShare * kept) + log_size(at_tip.covariance_N2) - 0.5 * residual_sigma * residual_sigma;
  return any;
}

BucketForceModel::Answers BucketForceModel::answers(const Torques& torques) const noexcept {
  Answers answers;
  answers.all[answers.count++] = anywhere(torques).answer;
  for (const Corner& corner : corners_)
    if (outlined_ && corner.share > 0) answers.all[answers.count++] = at(corner, torques);
  return answers;
}

BucketLoad BucketForceModel::Answers::mean() const noexcept {
  double most = all[0].log_weight, sum = 0;
  for (std::size_t i = 1; i < count; ++i) most = std::max(most, all[i].log_weight);
  BucketLoad mean;
  mean.residual_sigma = all[0].load.residual_sigma;
  for (std::size_t i = 0; i < count; ++i) {
    const BucketLoad& load = all[i].load;
    const double weight = std::exp(all[i].log_weight - most);
    sum += weight;
    mean.force_N += weight * load.force_N;
    mean.covariance_N2 += weight * (load.covariance_N2 + load.force_N * load.force_N.transpose());
    mean.torque_Nm += weight * load.torque_Nm;
    mean.torque_variance_N2m2 += weight * (load.torque_variance_N2m2 + load.torque_Nm * load.torque_Nm);
    mean.covariance_N2m += weight * (load.covariance_N2m + load.torque_Nm * load.force_N);
  }
  mean.force_N /= sum;
  mean.covariance_N2 = mean.covariance_N2 / sum - mean.force_N * mean.force_N.transpose();
  mean.torque_Nm /= sum;
  mean.torque_variance_N2m2 = std::max(0.0, mean.torque_variance_N2m2 / sum - mean.torque_Nm * mean.torque_Nm);
  mean.covariance_N2m = mean.covariance_N2m / sum - mean.torque_Nm * mean.force_N;
  return mean;
}

BucketLoad BucketForceModel::solve(const JointVector& joints_rad, const PlanarJacobian& jacobian,
                                   const JointVector& torque_Nm, const Eigen::Matrix3d& covariance_Nm2) const noexcept {
  const Torques known = torques(joints_rad, jacobian, torque_Nm, covariance_Nm2);
  BucketLoad load = answers(known).mean();
  if (known.all_known) add_torque(known, load);
  return load;
}

BucketLoad BucketForceModel::at_tip(const JointVector& joints_rad, const PlanarJacobian& jacobian,
                                    const JointVector& torque_Nm,
                                    const Eigen::Matrix3d& covariance_Nm2) const noexcept {
  const TipForce tip = solve_tip_force(jacobian, torque_Nm, covariance_Nm2);
  BucketLoad load = answers(torques(joints_rad, jacobian, torque_Nm, covariance_Nm2)).mean();
  // About another centre: what the answers are off it by counts in full.
  const PlanarVector off_N = load.force_N - tip.force_N;
  load.covariance_N2 += off_N * off_N.transpose();
  load.covariance_N2m += load.torque_Nm * off_N;
  load.torque_variance_N2m2 += load.torque_Nm * load.torque_Nm;
  load.force_N = tip.force_N;
  load.torque_Nm = 0;
  return load;
}

double BucketForceModel::couple_Nm(const JointVector& joints_rad, const PlanarJacobian& jacobian,
                                   const JointVector& torque_Nm, const Eigen::Matrix3d& covariance_Nm2) const noexcept {
  return anywhere(torques(joints_rad, jacobian, torque_Nm, covariance_Nm2)).couple_Nm;
}

}  // namespace knuckle::estimation
