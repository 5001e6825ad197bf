// Eigenvalues of a symmetric matrix of any size, off the loops. Eigen's solver takes seconds to compile for each size
// that it is used with: here it is compiled once.
#pragma once

#include <Eigen/Core>

namespace knuckle {

struct SymmetricEigen {
  Eigen::VectorXd values;   ///< Increasing.
  Eigen::MatrixXd vectors;  ///< Of unit length, one a column, in the order of the values.
};

/// @param matrix symmetric; its lower triangle is read.
[[nodiscard]] SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix);

}  // namespace knuckle
