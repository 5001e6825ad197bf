#include "core/symmetric_eigen.h"

#include <gtest/gtest.h>

namespace knuckle {
namespace {

TEST(SymmetricEigen, ValuesIncreaseAndVectorsBuildTheMatrixAgain) {
  for (const int size : {1, 2, 9, 27}) {
    const Eigen::MatrixXd any = Eigen::MatrixXd::Random(size, size);
    const Eigen::MatrixXd matrix = any + any.transpose();
    const SymmetricEigen eigen = symmetric_eigen(matrix);
    for (int i = 1; i < size; ++i) EXPECT_GE(eigen.values[i], eigen.values[i - 1]) << size;
    const Eigen::MatrixXd again = eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose();
    EXPECT_TRUE(again.isApprox(matrix, 1e-12)) << size;
    EXPECT_TRUE((eigen.vectors.transpose() * eigen.vectors).isIdentity(1e-12)) << size;
  }
}

}  // namespace
}  // namespace knuckle
