// Symmetric filters for recorded signals. What they cannot know they leave unknown: within half a kernel of a stretch's
// ends the answer is NaN, and shortened(stretches, ...) says what is left.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimation/identification/stretch.h"

namespace knuckle::estimation {

/// @param signals one row a signal, one column a sample; @param kernel of odd size.
/// @return same shape: kernel laid over each sample's surroundings (correlation, first coefficient on the earliest).
[[nodiscard]] Eigen::MatrixXd filtered(const Eigen::MatrixXd& signals, const Eigen::VectorXd& kernel,
                                       const std::vector<Stretch>& stretches);

/// Mean of 2 half_window + 1 samples, in a time that does not depend on half_window. Two in a row make a triangle.
[[nodiscard]] Eigen::MatrixXd box_filtered(const Eigen::MatrixXd& signals, Eigen::Index half_window,
                                           const std::vector<Stretch>& stretches);

/// Likewise, but near a stretch's ends over the part of the window that there is.
[[nodiscard]] Eigen::MatrixXd running_mean(const Eigen::MatrixXd& signals, Eigen::Index half_window,
                                           const std::vector<Stretch>& stretches);

/// Low-pass of odd size without phase: Hann-windowed sinc that reaches 2 / cutoff_Hz to either side. Half its height at
/// the cut-off, within 1 % of 1 below 0.5 and of 0 beyond 1.5 times that.
[[nodiscard]] Eigen::VectorXd low_pass_kernel(double cutoff_Hz, double step_s);

}  // namespace knuckle::estimation
