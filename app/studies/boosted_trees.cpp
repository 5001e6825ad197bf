// Trees on binned features: each split is searched over a histogram of residuals.
#include "app/studies/boosted_trees.h"

#include <algorithm>
#include <array>
#include <random>

namespace knuckle::studies {
namespace {

constexpr int kBins = 64;
constexpr double kShrink = 5;  ///< A leaf's mean counts so many samples of zero with it.

double share(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1.0p-53;
}

/// Edges that cut a feature's samples into bins of about equal count.
std::vector<double> edges_of(const Eigen::VectorXd& values) {
  std::vector<double> sorted(values.data(), values.data() + values.size());
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> edges;
  for (std::size_t bin = 1; bin < kBins; ++bin) {
    const double edge = sorted[sorted.size() * bin / kBins];
    if (edge > sorted.front() && (edges.empty() || edge > edges.back())) edges.push_back(edge);
  }
  return edges;
}

}  // namespace

class BoostedTrees::Grower {
 public:
  Grower(const Eigen::MatrixXd& features, const BoostingOptions& options)
      : options_(options), features_(features.cols()), random_(options.seed) {
    for (Eigen::Index column = 0; column < features_; ++column) {
      edges_.push_back(edges_of(features.col(column)));
      std::vector<std::uint8_t> bins(static_cast<std::size_t>(features.rows()));
      for (Eigen::Index row = 0; row < features.rows(); ++row) {
        const auto& edges = edges_.back();
        const auto above = std::upper_bound(edges.begin(), edges.end(), features(row, column));
        bins[static_cast<std::size_t>(row)] = static_cast<std::uint8_t>(above - edges.begin());
      }
      bins_.push_back(std::move(bins));
    }
  }

  [[nodiscard]] Tree grow(const Eigen::VectorXd& residual) {
    std::vector<int> rows;
    for (int row = 0; row < residual.size(); ++row) {
      if (share(random_) < options_.row_share) rows.push_back(row);
    }
    columns_.clear();
    for (int column = 0; column < features_; ++column) {
      if (share(random_) < options_.column_share) columns_.push_back(column);
    }
    Tree tree;
    add_node(tree, rows, residual, options_.depth);
    return tree;
  }

 private:
  struct Split {
    double gain = 1e-12;
    int column = -1, bin = 0;
  };

  int add_node(Tree& tree, const std::vector<int>& rows, const Eigen::VectorXd& residual, int depth) {
    const auto node = static_cast<std::size_t>(tree.size());
    tree.emplace_back();
    double sum = 0;
    for (const int row : rows) sum += residual[row];
    tree[node].value = sum / (static_cast<double>(rows.size()) + kShrink);
    const Split split = depth > 0 ? best_split(rows, residual, sum) : Split{};
    if (split.column < 0) return static_cast<int>(node);
    const auto column = static_cast<std::size_t>(split.column);
    std::vector<int> below, above;
    for (const int row : rows) {
      (bins_[column][static_cast<std::size_t>(row)] <= split.bin ? below : above).push_back(row);
    }
    tree[node].feature = split.column;
    tree[node].threshold = edges_[column][static_cast<std::size_t>(split.bin)];
    const int first = add_node(tree, below, residual, depth - 1);
    const int second = add_node(tree, above, residual, depth - 1);
    tree[node].below = first;
    tree[node].above = second;
    return static_cast<int>(node);
  }

  /// The cut that takes most off the sum of squares.
  [[nodiscard]] Split best_split(const std::vector<int>& rows, const Eigen::VectorXd& residual, double sum) const {
    const int count = static_cast<int>(rows.size());
    Split best;
    for (const int column : columns_) {
      const auto& bins = bins_[static_cast<std::size_t>(column)];
      std::array<double, kBins> sums{};
      std::array<int, kBins> counts{};
      for (const int row : rows) {
        const std::uint8_t bin = bins[static_cast<std::size_t>(row)];
        sums[bin] += residual[row];
        ++counts[bin];
      }
      double below_sum = 0;
      int below = 0;
      for (std::size_t bin = 0; bin < edges_[static_cast<std::size_t>(column)].size(); ++bin) {
        below_sum += sums[bin];
        below += counts[bin];
        if (below < options_.least_leaf || count - below < options_.least_leaf) continue;
        const double above_sum = sum - below_sum;
        const double gain = below_sum * below_sum / below + above_sum * above_sum / (count - below) - sum * sum / count;
        if (gain > best.gain) best = {gain, column, static_cast<int>(bin)};
      }
    }
    return best;
  }

  BoostingOptions options_;
  Eigen::Index features_;
  std::mt19937_64 random_;
  std::vector<std::vector<double>> edges_;
  std::vector<std::vector<std::uint8_t>> bins_;
  std::vector<int> columns_;
};

double BoostedTrees::leaf_value(const Tree& tree, const Eigen::MatrixXd& features, Eigen::Index row) {
  std::size_t node = 0;
  while (tree[node].feature >= 0) {
    const bool below = features(row, tree[node].feature) < tree[node].threshold;
    node = static_cast<std::size_t>(below ? tree[node].below : tree[node].above);
  }
  return tree[node].value;
}

BoostedTrees::BoostedTrees(const Eigen::MatrixXd& features, const Eigen::VectorXd& target,
                           const BoostingOptions& options)
    : base_(target.mean()), rate_(options.rate) {
  Grower grower(features, options);
  Eigen::VectorXd residual = target.array() - base_;
  for (int i = 0; i < options.trees; ++i) {
    trees_.push_back(grower.grow(residual));
    for (Eigen::Index row = 0; row < residual.size(); ++row) {
      residual[row] -= rate_ * leaf_value(trees_.back(), features, row);
    }
  }
}

Eigen::VectorXd BoostedTrees::predict(const Eigen::MatrixXd& features) const {
  Eigen::VectorXd result = Eigen::VectorXd::Constant(features.rows(), base_);
  for (const Tree& tree : trees_) {
    for (Eigen::Index row = 0; row < features.rows(); ++row) result[row] += rate_ * leaf_value(tree, features, row);
  }
  return result;
}

}  // namespace knuckle::studies
