#include "app/identify/held_out.h"

#include <algorithm>
#include <cmath>

namespace knuckle::identify {
namespace {

constexpr double kCutoff_Hz = 2;

std::vector<std::string> objections_of(std::span<const HoldOut> held_out, bool models_all, int joint) {
  const std::string name = kJointNames[static_cast<std::size_t>(joint)];
  std::vector<std::string> reasons;
  bool judged = false, constant = false;
  for (const HoldOut& held : held_out) {
    const double nrmse = held.judged().nrmse[joint];
    constant = constant || (!std::isfinite(nrmse) && std::isfinite(held.judged().rms_Nm[joint]));
    if (!std::isfinite(nrmse)) continue;
    judged = true;
    if (nrmse <= kWorstNrmse) continue;
    reasons.push_back(held.source + ": torque error " + std::to_string(std::lround(100 * nrmse)) +
                      " % of the held-out torque of the " + name + " (RMS over standard deviation), limit " +
                      std::to_string(std::lround(100 * kWorstNrmse)) + " %");
  }
  if (!judged && (models_all || constant))
    reasons.push_back("the " + name + " cannot be validated: " +
                      (constant ? "its held-out torque never changes" : "no held-out recording covers it"));
  return reasons;
}

}  // namespace

HoldOut held_out(const std::string& source, const std::string& method, const estimation::TorqueComparison& comparison) {
  return {source, method, estimation::torque_fit(comparison, kCutoff_Hz), estimation::torque_fit(comparison, 0)};
}

std::vector<std::string> objections(std::span<const HoldOut> held, bool models_all) {
  const bool validated = std::any_of(held.begin(), held.end(),
                                     [](const HoldOut& one) { return one.judged().nrmse.array().isFinite().any(); });
  if (!validated) return {"there is no held-out recording that could validate it"};
  std::vector<std::string> reasons;
  for (int j = 0; j < kJoints; ++j) {
    for (std::string& reason : objections_of(held, models_all, j)) reasons.push_back(std::move(reason));
  }
  return reasons;
}

}  // namespace knuckle::identify
