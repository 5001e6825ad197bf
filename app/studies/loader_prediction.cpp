// Features, XGBoost's trees and their linear rival.
#include "app/studies/loader_prediction.h"

#include <xgboost/c_api.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

namespace knuckle::studies {
namespace {

constexpr double kHistory_s = 1.5;  ///< Of a run before its first prediction, for every method.
constexpr int kBlocks = 6;          ///< Of cross-validation.
constexpr std::array kOrders{1, 2, 4, 8, 16, 24};
constexpr std::array kRidges{1e-6, 1e-3};  ///< Relative to the columns' variance.
using Channel = std::reference_wrapper<const std::vector<double>>;

std::vector<Channel> channels(const LoaderRun& run) {
  std::vector<Channel> all;
  for (const auto* quantity : {&run.speed_radps, &run.lever, &run.angle_rad, &run.force_MN}) {
    for (const auto& channel : *quantity) all.emplace_back(channel);
  }
  for (const auto* channel : {&run.engine_rps, &run.drive_axle_rps, &run.throttle, &run.gear, &run.digging}) {
    all.emplace_back(*channel);
  }
  return all;
}

std::size_t samples_in(double seconds, const LoaderRun& run) {
  return static_cast<std::size_t>(std::lround(seconds / run.step_s));
}

/// Value of a channel some samples ago; at a run's start its first value.
double past(const std::vector<double>& channel, std::size_t at, std::size_t ago) {
  return channel[at > ago ? at - ago : 0];
}

/// Mean of the last `count` samples that ended `ago` samples ago.
double mean(const std::vector<double>& channel, std::size_t at, std::size_t ago, std::size_t count) {
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k) sum += past(channel, at, ago + k);
  return sum / static_cast<double>(count);
}

/// One row per prediction of a run, columns from `row_at`.
template <typename RowAt>
Eigen::MatrixXd rows_of(std::span<const LoaderRun> runs, RowAt row_at) {
  std::vector<std::vector<double>> rows;
  for (const LoaderRun& run : runs) {
    const std::size_t horizon = samples_in(kPredictionHorizon_s, run);
    for (std::size_t i = samples_in(kHistory_s, run); i + horizon < run.size(); ++i) rows.push_back(row_at(run, i));
  }
  Eigen::MatrixXd result(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(rows.front().size()));
  for (Eigen::Index row = 0; row < result.rows(); ++row) {
    result.row(row) = Eigen::Map<Eigen::RowVectorXd>(rows[static_cast<std::size_t>(row)].data(), result.cols());
  }
  return result;
}

/// Now, changes over 0.25 s and 1 s, means over the last second and the one before; of speeds means to 4 s.
std::vector<double> features_at(const LoaderRun& run, std::size_t i, bool levers_known) {
  const std::size_t second = samples_in(1, run);
  std::vector<double> row;
  for (const std::vector<double>& channel : channels(run)) {
    row.push_back(channel[i]);
    row.push_back(channel[i] - past(channel, i, second / 4));
    row.push_back(channel[i] - past(channel, i, second));
    row.push_back(mean(channel, i, 0, second));
    row.push_back(mean(channel, i, second, second));
  }
  for (const auto& speed : run.speed_radps) {
    for (const double window_s : {0.15, 0.5, 2.0, 4.0}) row.push_back(mean(speed, i, 0, samples_in(window_s, run)));
  }
  if (levers_known) {
    for (const auto& lever : run.lever) {
      for (const std::size_t ahead : {second / 4, second / 2, 3 * second / 4, second}) {
        row.push_back(mean(lever, i + ahead, 0, second / 4));
      }
      row.push_back(mean(lever, i + second, 0, second));
    }
  }
  return row;
}

/// Lag by lag, so that a lower order is a left part; what is known of the levers ahead comes first.
std::vector<double> arx_row_at(const LoaderRun& run, std::size_t i, bool levers_known) {
  std::vector<double> row{1};
  if (levers_known) {
    for (const auto& lever : run.lever) {
      row.insert(row.end(), lever.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                 lever.begin() + static_cast<std::ptrdiff_t>(i + samples_in(kPredictionHorizon_s, run)) + 1);
    }
  }
  const std::vector<Channel> all = channels(run);
  for (std::size_t lag = 0; lag < static_cast<std::size_t>(kOrders.back()); ++lag) {
    for (const std::vector<double>& channel : all) row.push_back(past(channel, i, lag));
  }
  return row;
}

/// Ridge regression with order and ridge by cross-validation over blocks, all from the blocks' normal matrices.
class Arx {
 public:
  Arx(Eigen::MatrixXd columns, const Eigen::MatrixXd& targets, Eigen::Index first_lag, Eigen::Index per_lag)
      : scale_((columns.colwise().squaredNorm() / static_cast<double>(columns.rows())).cwiseSqrt().cwiseMax(1e-9)),
        first_lag_(first_lag),
        per_lag_(per_lag) {
    columns = columns * scale_.cwiseInverse().asDiagonal();
    for (int block = 0; block < kBlocks; ++block) {
      const Eigen::Index first = columns.rows() * block / kBlocks, end = columns.rows() * (block + 1) / kBlocks;
      const auto part = columns.middleRows(first, end - first);
      const auto wanted = targets.middleRows(first, end - first);
      normal_.emplace_back(part.transpose() * part);
      right_.emplace_back(part.transpose() * wanted);
      squares_.emplace_back(wanted.colwise().squaredNorm());
    }
    total_normal_ = Eigen::MatrixXd::Zero(columns.cols(), columns.cols());
    total_right_ = Eigen::MatrixXd::Zero(columns.cols(), targets.cols());
    for (std::size_t block = 0; block < kBlocks; ++block) {
      total_normal_ += normal_[block];
      total_right_ += right_[block];
    }
  }

  struct Choice {
    int order = 0;
    double ridge = 0;
    double squares = 0;
  };
  [[nodiscard]] Choice choose(Eigen::Index target) const {
    Choice best;
    for (const int order : kOrders) {
      for (const double ridge : kRidges) {
        const Choice choice{order, ridge, held_out_squares(target, order, ridge)};
        if (best.order == 0 || choice.squares < best.squares) best = choice;
      }
    }
    return best;
  }
  [[nodiscard]] Eigen::VectorXd predict(const Eigen::MatrixXd& columns, Eigen::Index target,
                                        const Choice& choice) const {
    const Eigen::Index count = width(choice.order);
    const Eigen::VectorXd weights = solve(total_normal_, total_right_.col(target), count, choice.ridge);
    return columns.leftCols(count) * scale_.head(count).transpose().cwiseInverse().cwiseProduct(weights);
  }

 private:
  [[nodiscard]] Eigen::Index width(int order) const { return first_lag_ + order * per_lag_; }
  [[nodiscard]] static Eigen::VectorXd solve(const Eigen::MatrixXd& normal, const Eigen::VectorXd& right,
                                             Eigen::Index count, double ridge) {
    Eigen::MatrixXd part = normal.topLeftCorner(count, count);
    part.diagonal() *= 1 + ridge;
    return part.ldlt().solve(right.head(count));
  }
  /// Sum of squares of each block's error with weights from the others.
  [[nodiscard]] double held_out_squares(Eigen::Index target, int order, double ridge) const {
    const Eigen::Index count = width(order);
    double sum = 0;
    for (std::size_t block = 0; block < kBlocks; ++block) {
      const Eigen::VectorXd weights =
          solve(total_normal_ - normal_[block], total_right_.col(target) - right_[block].col(target), count, ridge);
      sum += squares_[block][target] - 2 * weights.dot(right_[block].col(target).head(count)) +
             weights.dot(normal_[block].topLeftCorner(count, count) * weights);
    }
    return sum;
  }

  Eigen::RowVectorXd scale_;
  Eigen::Index first_lag_, per_lag_;
  std::vector<Eigen::MatrixXd> normal_, right_;
  std::vector<Eigen::RowVectorXd> squares_;
  Eigen::MatrixXd total_normal_, total_right_;
};

void check(int code) {
  if (code != 0) throw std::runtime_error(std::string("XGBoost: ") + XGBGetLastError());
}

/// Gradient-boosted regression trees of XGBoost: least squares, bounded by what they have seen; the same data give the
/// same trees.
class BoostedTrees {
 public:
  /// @param features one row a sample; @param target one a row.
  BoostedTrees(const Eigen::MatrixXd& features, const Eigen::VectorXd& target) {
    const Data data(features, &target);
    check(XGBoosterCreate(&data.handle, 1, &booster_));
    const std::string mean = std::to_string(target.mean());
    // What each tree gets to see is drawn at random; one thread, so that sums are always of the same order.
    for (const auto& [name, value] : {std::pair{"objective", "reg:squarederror"},
                                      {"base_score", mean.c_str()},
                                      {"max_depth", "4"},
                                      {"min_child_weight", "40"},
                                      {"eta", "0.05"},
                                      {"subsample", "0.6"},
                                      {"colsample_bytree", "0.5"},
                                      {"lambda", "0"},
                                      {"tree_method", "hist"},
                                      {"nthread", "1"},
                                      {"seed", "1"}})
      check(XGBoosterSetParam(booster_, name, value));
    constexpr int kTrees = 300;
    for (int tree = 0; tree < kTrees; ++tree) check(XGBoosterUpdateOneIter(booster_, tree, data.handle));
  }
  ~BoostedTrees() { XGBoosterFree(booster_); }
  BoostedTrees(const BoostedTrees&) = delete;
  BoostedTrees& operator=(const BoostedTrees&) = delete;

  /// @param features columns as in the fit. @return one value a row.
  [[nodiscard]] Eigen::VectorXd predict(const Eigen::MatrixXd& features) const {
    const Data data(features, nullptr);
    bst_ulong size = 0;
    const float* values = nullptr;
    check(XGBoosterPredict(booster_, data.handle, 0, 0, 0, &size, &values));
    return Eigen::Map<const Eigen::VectorXf>(values, static_cast<Eigen::Index>(size)).cast<double>();
  }

 private:
  struct Data {
    Data(const Eigen::MatrixXd& features, const Eigen::VectorXd* target) {
      const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = features.cast<float>();
      const auto count = static_cast<bst_ulong>(rows.rows());
      check(XGDMatrixCreateFromMat(rows.data(), count, static_cast<bst_ulong>(rows.cols()), std::nanf(""), &handle));
      if (target == nullptr) return;
      const Eigen::VectorXf label = target->cast<float>();
      check(XGDMatrixSetFloatInfo(handle, "label", label.data(), count));
    }
    ~Data() { XGDMatrixFree(handle); }
    Data(const Data&) = delete;
    Data& operator=(const Data&) = delete;
    DMatrixHandle handle = nullptr;
  };

  BoosterHandle booster_ = nullptr;
};

double rms(const Eigen::VectorXd& error) {
  return std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
}

}  // namespace

std::array<SpeedPrediction, kLoaderAxes> predict_speeds(std::span<const LoaderRun> train,
                                                        std::span<const LoaderRun> test, bool levers_known) {
  const auto speeds_ahead = [](const LoaderRun& run, std::size_t i) {
    const std::size_t ahead = i + samples_in(kPredictionHorizon_s, run);
    return std::vector<double>{run.speed_radps[kLift][ahead], run.speed_radps[kTilt][ahead]};
  };
  const auto speeds_now = [](const LoaderRun& run, std::size_t i) {
    return std::vector<double>{run.speed_radps[kLift][i], run.speed_radps[kTilt][i]};
  };
  const auto features = [&](const LoaderRun& run, std::size_t i) { return features_at(run, i, levers_known); };
  const auto arx_row = [&](const LoaderRun& run, std::size_t i) { return arx_row_at(run, i, levers_known); };

  const Eigen::MatrixXd train_target = rows_of(train, speeds_ahead), test_target = rows_of(test, speeds_ahead);
  const Eigen::MatrixXd train_features = rows_of(train, features), test_features = rows_of(test, features);
  const Eigen::MatrixXd train_columns = rows_of(train, arx_row), test_columns = rows_of(test, arx_row);
  const auto per_lag = static_cast<Eigen::Index>(channels(train.front()).size());
  const Arx arx(train_columns, train_target, train_columns.cols() - kOrders.back() * per_lag, per_lag);
  const Eigen::MatrixXd now = rows_of(test, speeds_now);

  std::array<SpeedPrediction, kLoaderAxes> result;
  for (std::size_t axis = 0; axis < kLoaderAxes; ++axis) {
    const auto column = static_cast<Eigen::Index>(axis);
    const BoostedTrees trees(train_features, train_target.col(column));
    const Arx::Choice choice = arx.choose(column);
    const Eigen::VectorXd target = test_target.col(column);
    result[axis] = {rms(trees.predict(test_features) - target), rms(now.col(column) - target),
                    rms(arx.predict(test_columns, column, choice) - target), static_cast<std::size_t>(target.size())};
  }
  return result;
}

}  // namespace knuckle::studies
