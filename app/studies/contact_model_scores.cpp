#include "app/studies/contact_model_scores.h"

#include <cmath>
#include <limits>
#include <variant>

#include "estimation/contact_models.h"

namespace knuckle::studies {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

PlanarVector no_answer() {
  return PlanarVector::Constant(kNaN);
}

}  // namespace

std::vector<ContactModelScore> score_contact_models(const MachineDescription& machine, const Trials& trials,
                                                    const std::vector<EstimateSample>& pulls) {
  const JointVector length_m(machine.links[0].length_m, machine.links[1].length_m, machine.links[2].length_m);
  std::vector<ContactModelScore> scores(3);
  scores[0].model = "tip_wrench";
  scores[1].model = "tip_force_of_two";
  scores[2].model = "force_and_position";
  for (const Press& press : trials.presses) {
    const std::size_t last = press.judge_to - 1;
    const PlanarVector truth = trials.pulls.truth[last].contact_N;
    const estimation::JointLoad& load = pulls[last].load;
    const auto keep = [&](ContactModelScore& score, const PlanarVector& answer) {
      score.presses.push_back(score_pull(truth, answer, press.creeping));
    };

    const auto wrench = estimation::tip_wrench(length_m, load);
    const auto* three = std::get_if<estimation::TipWrench>(&wrench);
    keep(scores[0], three != nullptr ? PlanarVector(three->wrench.head<2>()) : no_answer());
    if (three != nullptr) scores[0].torque_Nm.push_back(std::abs(three->wrench[2]));

    const auto force = estimation::tip_force_of_two(length_m, load, length_m[kBucket]);
    const auto* two = std::get_if<estimation::TwoJointForce>(&force);
    keep(scores[1], two != nullptr ? two->force_N : no_answer());

    const auto place = estimation::force_and_position(length_m, load, truth);
    const auto* at = std::get_if<estimation::ForceAtPlace>(&place);
    keep(scores[2], at != nullptr ? PlanarVector(at->force_N * truth.normalized()) : no_answer());
    if (at != nullptr) scores[2].place_error_m.push_back(std::abs(at->place_m - length_m[kBucket]));
  }
  return scores;
}

}  // namespace knuckle::studies
