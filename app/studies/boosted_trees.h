// Gradient-boosted regression trees (Friedman 2001, 2002): a regression for what has thresholds in it (dead bands, end
// stops, saturation), bounded by what it has seen.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace knuckle::studies {

struct BoostingOptions {
  int trees = 300, depth = 4;
  int least_leaf = 40;                         ///< Samples.
  double rate = 0.05;                          ///< Share of each tree that is added.
  double row_share = 0.6, column_share = 0.5;  ///< What each tree gets to see, drawn at random.
  std::uint64_t seed = 1;
};

class BoostedTrees {
 public:
  /// Least squares. @param features one row a sample, all finite; @param target one a row.
  /// The same arguments give the same trees.
  BoostedTrees(const Eigen::MatrixXd& features, const Eigen::VectorXd& target, const BoostingOptions& options = {});
  /// @param features columns as in the fit. @return one value a row.
  [[nodiscard]] Eigen::VectorXd predict(const Eigen::MatrixXd& features) const;

 private:
  struct Node {
    int feature = -1;  ///< -1: a leaf.
    double threshold = 0;
    int below = 0, above = 0;  ///< Nodes of the same tree.
    double value = 0;
  };
  using Tree = std::vector<Node>;
  class Grower;
  [[nodiscard]] static double leaf_value(const Tree& tree, const Eigen::MatrixXd& features, Eigen::Index row);

  double base_ = 0, rate_;
  std::vector<Tree> trees_;
};

}  // namespace knuckle::studies
