// Weighted robust linear least squares for identification: with what cannot be told apart found and named, and with two
// covariances: the naive one, and one that holds when errors of neighbouring rows go together.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace knuckle::estimation {

/// right = columns * parameters + error, one row an equation. Entries of `trust`, `group`, `cluster` and `floor` may be
/// left out as empty: 1, 0, each row its own, 0.
struct LeastSquaresProblem {
  Eigen::MatrixXd columns;
  Eigen::VectorXd right;
  Eigen::VectorXd weight;    ///< 1 / standard deviation of a row's error, up to a factor per group.
  Eigen::VectorXd trust;     ///< [0, 1]; a row of trust 0 does not count.
  std::vector<int> group;    ///< 0 .. groups - 1: rows whose `weight` shares one unknown factor.
  std::vector<int> cluster;  ///< Rows whose errors go together; equal numbers in any order.
  Eigen::VectorXd floor;     ///< A column whose weighted root mean square is below this is left out: it is noise.
};

struct LeastSquaresOptions {
  double huber = 0;              ///< Residuals beyond so many standard deviations count less; 0: all count.
  int iterations = 30;           ///< At most, of reweighting.
  double rank_tolerance = 1e-6;  ///< Of a singular value, to the largest one.
};

struct LeastSquaresSolution {
  Eigen::VectorXd parameters;       ///< The least one where several fit as well (columns scaled to equal norm).
  Eigen::VectorXd residual;         ///< right - columns * parameters, of each row.
  Eigen::VectorXd squared_weight;   ///< What each row counted in the end.
  Eigen::VectorXd group_sigma;      ///< Standard deviation of weight * residual, per group.
  Eigen::MatrixXd naive, sandwich;  ///< Covariances. Infinite on the diagonal of what cannot be told apart.
  Eigen::MatrixXd information;      ///< Weighted normal matrix.
  Eigen::VectorXd column_scale;     ///< Parameters in units of 1 / (norm of weighted column); 0 for one left out.
  Eigen::MatrixXd unseen;           ///< Orthonormal columns, scaled parameters: directions that change nothing.
  double condition_number = 0;      ///< Of the weighted, column-scaled regressor.
  int rank = 0;
};

/// Iterated: sigma of each group by the median absolute residual (which few bad rows do not move), then Huber's
/// weights, then least squares by QR.
[[nodiscard]] LeastSquaresSolution solve_least_squares(const LeastSquaresProblem& problem,
                                                       const LeastSquaresOptions& options = {});

/// One line per set of parameters that show only together: "J2 and J3 only together: J2 + 0.75 J3" (parameters in their
/// own units), or "J1 does not show in the data".
[[nodiscard]] std::vector<std::string> indistinct_combinations(const LeastSquaresSolution& solution,
                                                               const std::vector<std::string>& names);

}  // namespace knuckle::estimation
