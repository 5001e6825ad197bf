// How smooth a motion is, from its speed.
#pragma once

#include <optional>
#include <vector>

namespace knuckle::operators {

/// Spectral arc length, dimensionless and negative; the nearer to zero, the smoother. Neither the motion's size nor its
/// duration changes it, its halts and corrections do.
///   SPARC = -integral from 0 to w_c of sqrt((1 / w_c)^2 + (dV/dw)^2) dw,   V(w) = |F(w)| / F(0),
/// F the Fourier transform of the speed; w_c the highest frequency up to 10 Hz at which V is 0.05 or more.
/// Balasubramanian, Melendez-Calderon, Roby-Brami, Burdet: "On the analysis of movement smoothness", Journal of
/// NeuroEngineering and Rehabilitation 12:112, 2015. The spectrum is sampled as there: padded with zeros to 16 times
/// the next power of two.
/// @param speed equally spaced by step_s, from rest to rest. @return nullopt where nothing moves, or where there are
/// fewer than four samples.
[[nodiscard]] std::optional<double> spectral_arc_length(const std::vector<double>& speed, double step_s);

/// Maxima from which the speed falls, and to which it rises, by at least `least`: a motion in one go has one.
[[nodiscard]] int velocity_peaks(const std::vector<double>& speed, double least) noexcept;

}  // namespace knuckle::operators
