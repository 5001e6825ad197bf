// The geometry behind recorded angles and a recorded tip, where the bucket's angle is that of its linkage's rocker:
//   tip = base + l1 e(boom + a1) + l2 e(boom + arm + a2) + l3 e(boom + arm + psi),
// e(a) = (cos a, sin a). psi follows from the rocker by the four-bar's loop closure (Freudenstein 1955),
//   k1 cos f - k2 cos p + k3 = cos(f - p),  f = rocker + f0,  p = psi + p0.
#pragma once

#include <array>
#include <complex>
#include <optional>
#include <vector>

#include "core/joints.h"

namespace knuckle::studies {

/// One row of a recording.
struct TipSample {
  JointVector angle_rad, rate_radps;  ///< As recorded: boom, arm, bucket; and how fast they change there.
  double bucket_joint_rad = 0;        ///< What the machine's own computer says of the bucket; not used by the fit.
  PlanarVector tip_m;
};

/// A fitted geometry.
struct TipGeometry {
  static constexpr int kCount = 13;
  enum Index { kBaseX, kBaseZ, kBoom_m, kBoomAngle, kArm_m, kArmAngle, kBucket_m, kK1, kK2, kK3, kF0, kP0, kLatency_s };
  std::array<double, kCount> value{}, sigma{};
  double branch = 1;  ///< Which of the loop's two solutions.
  [[nodiscard]] PlanarVector tip(const TipSample& sample) const;
};

/// Robust least squares (Ceres; errors beyond 1 cm pull little, as late or repeated angles must not bend the geometry),
/// with a latency between angles and tip as one of the unknowns. Starts from a fit with a linear bucket, so that no
/// geometry need be known. @return nullopt where it finds none.
[[nodiscard]] std::optional<TipGeometry> fit_tip_geometry(const std::vector<TipSample>& samples);

/// The plain chain: three links on angles (ccw, each from the one before), base, lengths and offsets by linear least
/// squares; robust: by least absolute errors. Baseline and start of the above.
struct PlainChain {
  std::array<std::complex<double>, 4> coefficient{};  ///< base, boom, arm, bucket: length and offset of each
  double bucket_factor = 1;
  double mean_error_m = 0;  ///< Over what it was fitted to.
  [[nodiscard]] PlanarVector tip(const JointVector& angle_rad) const;
};
[[nodiscard]] PlainChain fit_plain_chain(const std::vector<TipSample>& samples, double bucket_factor, bool robust);

}  // namespace knuckle::studies
