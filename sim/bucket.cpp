#include "sim/bucket.h"

#include <algorithm>

#include "machine/description.h"

namespace knuckle::sim {

const char* name(BucketPlace place) noexcept {
  constexpr std::array<const char*, kPlaces> kNames{"tip", "edge", "heel", "back", "pin", "cheek", "linkage"};
  return kNames[static_cast<std::size_t>(place)];
}

BucketOutline::BucketOutline(const MachineDescription& machine) {
  const BucketProfile& profile = machine.bucket_profile;
  corners_ = {PlanarVector(machine.links[kBucket].length_m, 0),
              profile.edge_m,
              profile.heel_m,
              profile.back_m,
              PlanarVector(PlanarVector::Zero()),
              profile.cheek_m};
  for (std::size_t i = 0; i < kCorners; ++i) {
    const PlanarVector run = corners_[(i + 1) % kCorners] - corners_[i];
    length_m_[i] = run.norm();
    along_[i] = run / length_m_[i];
    outward_[i] = -perp(along_[i]);
    radius_m_ = std::max(radius_m_, corners_[i].norm());
  }
  const BucketLinkage& linkage = machine.bucket_linkage;
  radius_m_ = std::max(radius_m_, linkage.bucket_pin_m.norm() + linkage.coupler_length_m);
}

std::size_t BucketOutline::nearest_side(const PlanarVector& at_m) const noexcept {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < kCorners; ++i) {
    if (outside(i, at_m) > outside(nearest, at_m)) nearest = i;
  }
  return nearest;
}

PlanarVector BucketOutline::nearest(const PlanarVector& at_m) const noexcept {
  PlanarVector best = corners_[0];
  double best2 = (at_m - best).squaredNorm();
  for (std::size_t i = 0; i < kCorners; ++i) {
    const double run = std::clamp((at_m - corners_[i]).dot(along_[i]), 0.0, length_m_[i]);
    const PlanarVector point = corners_[i] + run * along_[i];
    const double distance2 = (at_m - point).squaredNorm();
    if (distance2 < best2) {
      best = point;
      best2 = distance2;
    }
  }
  return best;
}

}  // namespace knuckle::sim
