// Smoothing and differentiation by a polynomial fitted to a sliding window (Savitzky and Golay, 1964).
#pragma once

#include <Eigen/Core>

namespace knuckle::estimation {

/// FIR coefficients, to be laid over samples i - half_window .. i + half_window (first coefficient on the earliest).
/// Their sum of products is the derivative at sample i of the polynomial that fits the window best: exact for
/// polynomials up to `order`.
/// @param derivative 0 (smoothing), 1 [1/s] or 2 [1/s^2]; @param order of the polynomial, below 2 half_window + 1.
[[nodiscard]] Eigen::VectorXd savitzky_golay(int half_window, int order, int derivative, double step_s);

}  // namespace knuckle::estimation
