#include "estimation/identification/least_squares.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "core/quantile.h"

namespace knuckle::estimation {
namespace {

constexpr double kUnseen = std::numeric_limits<double>::infinity();
using SquareSvd = Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner>;

/// Column scaling, QR and singular values of the rows as weighted now.
struct Factored {
  Factored(const LeastSquaresProblem& problem, const Eigen::VectorXd& squared_weight, double tolerance) {
    const Eigen::VectorXd root = squared_weight.cwiseSqrt();
    Eigen::MatrixXd weighted = root.asDiagonal() * problem.columns;
    scale = weighted.colwise().norm();
    for (Eigen::Index j = 0; j < scale.size(); ++j) {
      const double floor = problem.floor.size() > 0 ? problem.floor[j] * root.norm() : 0;
      scale[j] = scale[j] > floor ? 1 / scale[j] : 0;
    }
    weighted *= scale.asDiagonal();
    Eigen::VectorXd right = root.cwiseProduct(problem.right);
    if (weighted.rows() < weighted.cols()) {  // rows that say nothing, for the sake of the factorisation
      right.conservativeResizeLike(Eigen::VectorXd::Zero(weighted.cols()));
      weighted.conservativeResizeLike(Eigen::MatrixXd::Zero(weighted.cols(), weighted.cols()));
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(weighted);
    const Eigen::Index n = weighted.cols();
    const Eigen::MatrixXd r = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
    const SquareSvd svd(r, Eigen::ComputeThinU | Eigen::ComputeThinV);
    right.applyOnTheLeft(qr.householderQ().adjoint());
    singular = svd.singularValues();
    directions = svd.matrixV();
    rank = 0;
    while (rank < n && singular[rank] > tolerance * singular[0]) ++rank;
    const Eigen::VectorXd along = svd.matrixU().leftCols(rank).transpose() * right.head(n);
    const Eigen::VectorXd scaled = directions.leftCols(rank) * along.cwiseQuotient(singular.head(rank));
    parameters = scale.cwiseProduct(scaled);
  }
  /// (columns^T W columns)^-1 on what is seen.
  [[nodiscard]] Eigen::MatrixXd inverse_information() const {
    const Eigen::MatrixXd seen =
        scale.asDiagonal() * directions.leftCols(rank) * singular.head(rank).cwiseInverse().asDiagonal();
    return seen * seen.transpose();
  }
  Eigen::VectorXd scale, singular, parameters;
  Eigen::MatrixXd directions;
  Eigen::Index rank = 0;
};

class Solver {
 public:
  Solver(const LeastSquaresProblem& problem, const LeastSquaresOptions& options)
      : problem_(problem), options_(options), rows_(problem.right.size()) {
    groups_ = problem.group.empty() ? 1 : 1 + *std::max_element(problem.group.begin(), problem.group.end());
    sigma_ = Eigen::VectorXd::Ones(groups_);
    squared_weight_ = prior_squared_weight();
  }

  LeastSquaresSolution solve() {
    Factored factored(problem_, squared_weight_, options_.rank_tolerance);
    for (int n = 0; n < options_.iterations; ++n) {
      const Eigen::VectorXd before = factored.parameters;
      reweight(problem_.right - problem_.columns * before);
      factored = Factored(problem_, squared_weight_, options_.rank_tolerance);
      const Eigen::VectorXd change = factored.parameters - before;
      if (change.norm() <= 1e-10 * before.norm()) break;
    }
    return finish(factored);
  }

 private:
  [[nodiscard]] double trust(Eigen::Index row) const { return problem_.trust.size() > 0 ? problem_.trust[row] : 1; }
  [[nodiscard]] int group(Eigen::Index row) const {
    return problem_.group.empty() ? 0 : problem_.group[static_cast<std::size_t>(row)];
  }
  [[nodiscard]] Eigen::VectorXd prior_squared_weight() const {
    Eigen::VectorXd w(rows_);
    for (Eigen::Index i = 0; i < rows_; ++i) w[i] = trust(i) * std::pow(problem_.weight[i] / sigma_[group(i)], 2);
    return w;
  }

  void reweight(const Eigen::VectorXd& residual) {
    constexpr double kMadOfNormal = 0.6745, kTrusted = 0.5;
    std::vector<std::vector<double>> sizes(static_cast<std::size_t>(groups_));
    for (Eigen::Index i = 0; i < rows_; ++i) {
      if (trust(i) > kTrusted)
        sizes[static_cast<std::size_t>(group(i))].push_back(std::abs(problem_.weight[i] * residual[i]));
    }
    for (int g = 0; g < groups_; ++g) {
      const double sigma = upper_median(std::move(sizes[static_cast<std::size_t>(g)])) / kMadOfNormal;
      if (sigma > 0) sigma_[g] = sigma;  // a perfect fit leaves it as it was
    }
    squared_weight_ = prior_squared_weight();
    if (options_.huber <= 0) return;
    for (Eigen::Index i = 0; i < rows_; ++i) {
      const double size = std::abs(problem_.weight[i] * residual[i]) / sigma_[group(i)];
      if (size > options_.huber) squared_weight_[i] *= options_.huber / size;
    }
  }

  LeastSquaresSolution finish(const Factored& factored) const {
    LeastSquaresSolution s;
    s.parameters = factored.parameters;
    s.residual = problem_.right - problem_.columns * s.parameters;
    s.squared_weight = squared_weight_;
    s.group_sigma = sigma_;
    s.column_scale = factored.scale;
    s.information = problem_.columns.transpose() * squared_weight_.asDiagonal() * problem_.columns;
    s.rank = static_cast<int>(factored.rank);
    const Eigen::Index n = factored.singular.size();
    s.unseen = factored.directions.rightCols(n - factored.rank);
    s.condition_number = factored.singular[n - 1] > 0 ? factored.singular[0] / factored.singular[n - 1] : kUnseen;
    const Eigen::MatrixXd inverse = factored.inverse_information();
    const double squares = squared_weight_.dot(s.residual.cwiseAbs2());
    s.naive = inverse * squares / std::max(1.0, static_cast<double>(rows_ - n));
    s.sandwich = inverse * meat(s.residual) * inverse;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (factored.scale[j] > 0 && (s.unseen.cols() == 0 || s.unseen.row(j).norm() < 1e-3)) continue;
      s.naive(j, j) = s.sandwich(j, j) = kUnseen;
    }
    return s;
  }

  /// Sum over clusters of the outer product of their score (Liang and Zeger 1986).
  [[nodiscard]] Eigen::MatrixXd meat(const Eigen::VectorXd& residual) const {
    const Eigen::Index n = problem_.columns.cols();
    std::map<int, Eigen::VectorXd> scores;
    for (Eigen::Index i = 0; i < rows_; ++i) {
      const int cluster =
          problem_.cluster.empty() ? static_cast<int>(i) : problem_.cluster[static_cast<std::size_t>(i)];
      Eigen::VectorXd& score = scores.try_emplace(cluster, Eigen::VectorXd::Zero(n)).first->second;
      score += squared_weight_[i] * residual[i] * problem_.columns.row(i).transpose();
    }
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
    for (const auto& [cluster, score] : scores) sum += score * score.transpose();
    const auto count = static_cast<double>(scores.size());
    return count > 1 ? Eigen::MatrixXd(sum * count / (count - 1)) : sum;
  }

  const LeastSquaresProblem& problem_;
  LeastSquaresOptions options_;
  Eigen::Index rows_;
  int groups_ = 1;
  Eigen::VectorXd sigma_, squared_weight_;
};

std::string listed(const std::vector<std::string>& names) {
  const std::string before = fmt::format("{}", fmt::join(names.begin(), names.end() - 1, ", "));
  return before + (names.size() > 1 ? " and " : "") + names.back();
}

/// c^T parameters in words; `combination` in scaled parameters.
std::string sum_text(const Eigen::VectorXd& combination, const Eigen::VectorXd& scale,
                     const std::vector<std::string>& names) {
  constexpr double kLeastShare = 0.02;
  Eigen::Index lead = 0;
  combination.cwiseAbs().maxCoeff(&lead);
  const double unit = combination[lead] / scale[lead];
  std::string text = names[static_cast<std::size_t>(lead)];
  for (Eigen::Index j = 0; j < combination.size(); ++j) {
    if (j == lead || std::abs(combination[j]) < kLeastShare * std::abs(combination[lead])) continue;
    const double factor = combination[j] / scale[j] / unit;
    text +=
        fmt::format("{}{:.2g} {}", factor < 0 ? " - " : " + ", std::abs(factor), names[static_cast<std::size_t>(j)]);
  }
  return text;
}

/// Parameters that hang together: neighbours wherever the projector on the unseen directions ties two of them.
std::vector<std::vector<Eigen::Index>> tied_sets(const Eigen::MatrixXd& tie) {
  constexpr double kTied = 0.02;
  std::vector<std::vector<Eigen::Index>> sets;
  std::vector<bool> done(static_cast<std::size_t>(tie.rows()), false);
  for (Eigen::Index start = 0; start < tie.rows(); ++start) {
    if (done[static_cast<std::size_t>(start)] || tie(start, start) < kTied) continue;
    std::vector<Eigen::Index> set{start};
    done[static_cast<std::size_t>(start)] = true;
    for (std::size_t at = 0; at < set.size(); ++at) {
      for (Eigen::Index j = 0; j < tie.rows(); ++j) {
        if (done[static_cast<std::size_t>(j)] || std::abs(tie(set[at], j)) < kTied) continue;
        done[static_cast<std::size_t>(j)] = true;
        set.push_back(j);
      }
    }
    std::sort(set.begin(), set.end());
    sets.push_back(set);
  }
  return sets;
}

std::string set_text(const Eigen::MatrixXd& tie, const std::vector<Eigen::Index>& set,
                     const LeastSquaresSolution& solution, const std::vector<std::string>& names) {
  const auto size = static_cast<Eigen::Index>(set.size());
  const Eigen::MatrixXd within = tie(set, set);
  const Eigen::VectorXd scale = solution.column_scale(set);
  std::vector<std::string> members;
  for (const Eigen::Index j : set) members.push_back(names[static_cast<std::size_t>(j)]);
  // Of a projector the singular values are 1 for what is unseen and 0 for what the data do say of the set.
  const SquareSvd svd(within, Eigen::ComputeFullU);
  const Eigen::Index seen = (svd.singularValues().array() < 0.5).count();
  if (seen == 0) return listed(members) + (size == 1 ? " does not show in the data" : " do not show in the data");
  std::string text = listed(members) + " only together: ";
  for (Eigen::Index k = size - seen; k < size; ++k)
    text += (k > size - seen ? "; " : "") + sum_text(svd.matrixU().col(k), scale, members);
  return text;
}

}  // namespace

LeastSquaresSolution solve_least_squares(const LeastSquaresProblem& problem, const LeastSquaresOptions& options) {
  return Solver(problem, options).solve();
}

std::vector<std::string> indistinct_combinations(const LeastSquaresSolution& solution,
                                                 const std::vector<std::string>& names) {
  const Eigen::MatrixXd tie = solution.unseen * solution.unseen.transpose();
  std::vector<std::string> lines;
  for (const std::vector<Eigen::Index>& set : tied_sets(tie)) lines.push_back(set_text(tie, set, solution, names));
  return lines;
}

}  // namespace knuckle::estimation
