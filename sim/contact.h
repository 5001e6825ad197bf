// What a contact is made of: an elastic bristle for friction, and forces collected into a wrench on the bucket.
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "sim/bucket.h"

namespace knuckle::sim {

/// A spring to an anchor that is dragged along where the force would pass its limit: sticks, then slides, at any speed
/// without the stiffness of a regularised sign.
struct Bristle {
  double stiffness_N_per_m, damping_Ns_per_m;
  double anchor_m = 0;
  [[nodiscard]] double force(double at_m, double rate_mps, double limit_N) const noexcept {
    return std::clamp(-stiffness_N_per_m * (at_m - anchor_m) - damping_Ns_per_m * rate_mps, -limit_N, limit_N);
  }
  void drag(double at_m, double limit_N) noexcept {
    const double stretch = limit_N / stiffness_N_per_m;
    anchor_m = std::clamp(anchor_m, at_m - stretch, at_m + stretch);
  }
};

/// Forces of the world on the machine, frame W.
struct ContactForces {
  // By cause; ground is a wall.
  PlanarVector wall = PlanarVector::Zero(), soil = PlanarVector::Zero(), pipe = PlanarVector::Zero(),
               piece = PlanarVector::Zero();
  PlanarVector bucket_N = PlanarVector::Zero();     ///< All on the bucket,
  double bucket_Nm = 0;                             ///< and their moment about the bucket pin.
  PlanarVector linkage_N = PlanarVector::Zero();    ///< On the pin between rocker and coupler.
  double weight_N = 0;                              ///< Sum of the forces' norms,
  PlanarVector weighted_Nm = PlanarVector::Zero();  ///< and of the norms times where they act, from the bucket pin.

  [[nodiscard]] PlanarVector sum() const noexcept { return bucket_N + linkage_N; }
  /// Mechanical power of the world on the machine.
  [[nodiscard]] double power_W(const BucketMotion& bucket) const noexcept {
    return bucket_N.dot(bucket.pin_mps) + bucket_Nm * bucket.rate_radps + linkage_N.dot(bucket.linkage_mps);
  }
  /// @param cause nullptr: a test rig.
  void on_bucket(PlanarVector ContactForces::*cause, const BucketMotion& bucket, const PlanarVector& at_m,
                 const PlanarVector& force_N) noexcept {
    bucket_N += force_N;
    bucket_Nm += cross(at_m - bucket.pin_m, force_N);
    count(cause, bucket, at_m, force_N);
  }
  void on_linkage(PlanarVector ContactForces::*cause, const BucketMotion& bucket,
                  const PlanarVector& force_N) noexcept {
    linkage_N += force_N;
    count(cause, bucket, bucket.linkage_m, force_N);
  }
  /// On a corner of the outline or on the linkage's pin.
  void on_place(PlanarVector ContactForces::*cause, const BucketMotion& bucket, std::size_t place,
                const PlanarVector& at_m, const PlanarVector& force_N) noexcept {
    if (place < kCorners)
      on_bucket(cause, bucket, at_m, force_N);
    else
      on_linkage(cause, bucket, force_N);
  }

 private:
  void count(PlanarVector ContactForces::*cause, const BucketMotion& bucket, const PlanarVector& at_m,
             const PlanarVector& force_N) noexcept {
    if (cause != nullptr) this->*cause += force_N;
    const double norm_N = force_N.norm();
    weight_N += norm_N;
    weighted_Nm += norm_N * (at_m - bucket.pin_m);
  }
};

/// How the bucket answers a force (x, z) and a moment at its pin, frame W: accelerations of pin and angle.
using Mobility = Eigen::Matrix3d;

}  // namespace knuckle::sim
