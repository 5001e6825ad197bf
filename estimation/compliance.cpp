#include "estimation/compliance.h"

#include "machine/description.h"

namespace knuckle::estimation {
namespace {

// At the tip of a stretched arm of kReach_m.
constexpr PerJoint<double> kBending_m_per_N{1.5e-6, 1e-6, 0.5e-6};
constexpr double kGround_m_per_N = 2e-6, kReach_m = 3.2;

}  // namespace

JointVector usual_compliance_radpNm(const MachineDescription& machine) {
  double out_m = 0;  // joint to tip
  JointVector compliance;
  for (int i = kJoints - 1; i >= 0; --i) {
    out_m += machine.links[static_cast<std::size_t>(i)].length_m;
    compliance[i] =
        (kBending_m_per_N[static_cast<std::size_t>(i)] + (i == kBoom ? kGround_m_per_N : 0)) / (out_m * out_m);
  }
  return compliance * (kReach_m / out_m);
}

}  // namespace knuckle::estimation
