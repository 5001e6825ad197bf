// Cost of identification over the length of the recording, and of its solver beside Ceres on the same rows.
#include <benchmark/benchmark.h>
#include <ceres/ceres.h>

#include <array>
#include <random>

#include "estimation/identification/full.h"
#include "estimation/identification/least_squares.h"
#include "tests/identification/synthetic.h"

namespace knuckle::estimation {
namespace {

/// 200 s at 200 Hz may take 8 s, 40 s at 100 Hz 1 s; the time grows with the number of samples. One fit, as usual
/// errors repeat it.
void BM_IdentifyFull(benchmark::State& bench) {
  const MachineDescription machine = plain_machine();
  const double rate_Hz = static_cast<double>(bench.range(1));
  const std::array recordings{
      recorded(machine, RichMotion(), static_cast<double>(bench.range(0)), 1 / rate_Hz, real_sensors())};
  FullOptions options;
  options.usual_errors = false;
  for (auto _ : bench) {
    const FullResult result = identify_full(machine, recordings, options);
    if (!result.summary.usable) bench.SkipWithError(result.summary.reasons.front().c_str());
    benchmark::DoNotOptimize(result.dynamics.parameters.data());
  }
  bench.SetComplexityN(bench.range(0) * bench.range(1));
}
BENCHMARK(BM_IdentifyFull)->ArgNames({"seconds", "Hz"})->Args({40, 100})->Unit(benchmark::kMillisecond);
BENCHMARK(BM_IdentifyFull)
    ->Name("BM_IdentifyFullOverLength")
    ->ArgNames({"seconds", "Hz"})
    ->ArgsProduct({{50, 100, 200}, {200}})
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oN);

/// 12000 rows of 24 unknowns with a tenth of outliers: as many as 200 s give `full`.
const LeastSquaresProblem& robust_problem() {
  static const LeastSquaresProblem problem = [] {
    LeastSquaresProblem p;
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    p.columns = Eigen::MatrixXd::NullaryExpr(12000, kCalibrationCount, [&] { return normal(random); });
    p.right = p.columns * Eigen::VectorXd::Ones(kCalibrationCount);
    for (Eigen::Index i = 0; i < p.right.size(); ++i) p.right[i] += (i % 10 == 0 ? 10 : 0.1) * normal(random);
    p.weight = Eigen::VectorXd::Ones(p.right.size());
    return p;
  }();
  return problem;
}

void BM_RobustLeastSquares(benchmark::State& bench) {
  for (auto _ : bench) {
    const LeastSquaresSolution solution = solve_least_squares(robust_problem(), {.huber = 2.5});
    benchmark::DoNotOptimize(solution.parameters.data());
  }
}
BENCHMARK(BM_RobustLeastSquares)->Unit(benchmark::kMillisecond);

/// One row of the linear problem, with its derivative in closed form: the fairest Ceres can be given.
class RowCost : public ceres::SizedCostFunction<1, kCalibrationCount> {
 public:
  RowCost(const LeastSquaresProblem& problem, Eigen::Index row) : problem_(problem), row_(row) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    using Vector = Eigen::Matrix<double, kCalibrationCount, 1>;
    residuals[0] = problem_.right[row_] - problem_.columns.row(row_).dot(Eigen::Map<const Vector>(parameters[0]));
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Vector> derivative(jacobians[0]);
      derivative = -problem_.columns.row(row_).transpose();
    }
    return true;
  }

 private:
  const LeastSquaresProblem& problem_;
  Eigen::Index row_;
};

void BM_RobustLeastSquaresByCeres(benchmark::State& bench) {
  const LeastSquaresProblem& rows = robust_problem();
  for (auto _ : bench) {
    CalibrationVector parameters = CalibrationVector::Zero();
    ceres::Problem problem;
    for (Eigen::Index i = 0; i < rows.right.size(); ++i)
      problem.AddResidualBlock(new RowCost(rows, i), new ceres::HuberLoss(0.25), parameters.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    options.num_threads = 1;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    benchmark::DoNotOptimize(parameters.data());
  }
}
BENCHMARK(BM_RobustLeastSquaresByCeres)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace knuckle::estimation
