// Robust weighted least squares: exact answers, honest spread, and what it says of parameters it cannot tell apart.
#include "estimation/identification/least_squares.h"

#include <gtest/gtest.h>

#include <random>

namespace knuckle::estimation {
namespace {

LeastSquaresProblem line_problem(std::mt19937& random, double noise) {
  std::normal_distribution<double> normal;
  LeastSquaresProblem problem;
  problem.columns.resize(400, 2);
  problem.right.resize(400);
  for (Eigen::Index i = 0; i < 400; ++i) {
    const double x = static_cast<double>(i) / 400;
    problem.columns.row(i) << 1, x;
    problem.right[i] = 3 + 2 * x + noise * normal(random);
  }
  problem.weight = Eigen::VectorXd::Ones(400);
  return problem;
}

TEST(LeastSquares, NaiveAndSandwichAgreeForIndependentErrors) {
  std::mt19937 random(2);
  const LeastSquaresSolution s = solve_least_squares(line_problem(random, 0.1));
  // Textbook: variance of the slope is sigma^2 / sum (x - mean)^2.
  const double textbook = 0.1 / std::sqrt(400.0 / 12);
  EXPECT_NEAR(std::sqrt(s.naive(1, 1)), textbook, 0.15 * textbook);
  EXPECT_NEAR(std::sqrt(s.sandwich(1, 1)), textbook, 0.2 * textbook);
  EXPECT_NEAR(s.group_sigma[0], 0.1, 0.02);
}

TEST(LeastSquares, SandwichSeesErrorsThatGoTogether) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  LeastSquaresProblem problem = line_problem(random, 0);
  double error = 0;
  for (Eigen::Index i = 0; i < 400; ++i) {
    if (i % 20 == 0) error = 0.1 * normal(random);
    problem.right[i] += error;
    problem.cluster.push_back(static_cast<int>(i / 20));
  }
  const LeastSquaresSolution s = solve_least_squares(problem);
  EXPECT_GT(s.sandwich(1, 1), 5 * s.naive(1, 1));  // 20 rows that say one thing: variance up to 20 times
}

TEST(LeastSquares, HuberKeepsBadRowsFromPullingTheAnswer) {
  std::mt19937 random(4);
  LeastSquaresProblem problem = line_problem(random, 0.01);
  for (Eigen::Index i = 380; i < 400; ++i) problem.right[i] += 5;
  const double plain = solve_least_squares(problem).parameters[1];
  const double robust = solve_least_squares(problem, {.huber = 2.5}).parameters[1];
  EXPECT_GT(std::abs(plain - 2), 0.5);
  EXPECT_LT(std::abs(robust - 2), 0.02);
}

TEST(LeastSquares, GroupsFindTheirOwnSpread) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  LeastSquaresProblem problem = line_problem(random, 0);
  for (Eigen::Index i = 0; i < 400; ++i) {
    problem.group.push_back(static_cast<int>(i % 2));
    problem.right[i] += (i % 2 == 0 ? 1.0 : 0.01) * normal(random);
  }
  const LeastSquaresSolution s = solve_least_squares(problem);
  EXPECT_NEAR(s.group_sigma[0], 1, 0.2);
  EXPECT_NEAR(s.group_sigma[1], 0.01, 0.002);
  EXPECT_NEAR(s.parameters[1], 2, 0.02);
}

TEST(LeastSquares, NamesParametersThatShowOnlyTogether) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(-1, 1);
  LeastSquaresProblem problem;
  problem.columns.resize(50, 4);
  for (Eigen::Index i = 0; i < 50; ++i) {
    const double a = uniform(random), b = uniform(random);
    problem.columns.row(i) << a, b, 0.75 * b, 0;
  }
  problem.right = problem.columns * Eigen::Vector4d(1, 2, 3, 4);
  problem.weight = Eigen::VectorXd::Ones(50);
  const LeastSquaresSolution s = solve_least_squares(problem);
  EXPECT_EQ(s.rank, 2);
  EXPECT_NEAR(s.parameters[0], 1, 1e-10);
  EXPECT_NEAR(s.parameters[1] + 0.75 * s.parameters[2], 2 + 0.75 * 3, 1e-10);
  EXPECT_TRUE(std::isfinite(s.sandwich(0, 0)));
  EXPECT_TRUE(std::isinf(s.sandwich(1, 1)));
  const std::vector<std::string> words = indistinct_combinations(s, {"J1", "J2", "J3", "X1"});
  ASSERT_EQ(words.size(), 2U);
  EXPECT_TRUE(words[0] == "J2 and J3 only together: J2 + 0.75 J3" || words[0] == "J2 and J3 only together: J3 + 1.3 J2")
      << words[0];
  EXPECT_EQ(words[1], "X1 does not show in the data");
}

}  // namespace
}  // namespace knuckle::estimation
