#include "app/studies/contact_model_scores.h"

#include <cmath>
#include <limits>
#include <variant>

#include "app/studies/force_scores.h"
#include "estimation/contact_models.h"

namespace knuckle::studies {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

PlanarVector no_answer() {
  return PlanarVector::Constant(kNaN);
}

Row model_metrics(const std::vector<PressScore>& presses) {
  std::vector<double> answered;
  for (const PressScore& press : presses) answered.push_back(std::isnan(press.error_N) ? 0 : 1);
  Row metrics;
  metrics["answered"] = metric(answered);
  add_presses(presses, metrics);
  return metrics;
}

}  // namespace

Row score_contact_models(const MachineDescription& machine, const Trials& trials,
                         const std::vector<EstimateSample>& pulls) {
  const JointVector length_m(machine.links[0].length_m, machine.links[1].length_m, machine.links[2].length_m);
  std::vector<PressScore> wrenches, forces, places;
  std::vector<double> torque_Nm, place_error_m;
  for (const Press& press : trials.presses) {
    const std::size_t last = press.judge_to - 1;
    const PlanarVector truth = trials.pulls.truth[last].contact_N;
    const estimation::JointLoad& load = pulls[last].load;
    const auto score = [&](const PlanarVector& answer) { return score_pull(truth, answer, press.creeping); };

    const auto wrench = estimation::tip_wrench(length_m, load);
    const auto* three = std::get_if<estimation::TipWrench>(&wrench);
    wrenches.push_back(score(three != nullptr ? PlanarVector(three->wrench.head<2>()) : no_answer()));
    if (three != nullptr) torque_Nm.push_back(std::abs(three->wrench[2]));

    const auto force = estimation::tip_force_of_two(length_m, load, length_m[kBucket]);
    const auto* two = std::get_if<estimation::TwoJointForce>(&force);
    forces.push_back(score(two != nullptr ? two->force_N : no_answer()));

    const auto place = estimation::force_and_position(length_m, load, truth);
    const auto* at = std::get_if<estimation::ForceAtPlace>(&place);
    places.push_back(score(at != nullptr ? PlanarVector(at->force_N * truth.normalized()) : no_answer()));
    if (at != nullptr) place_error_m.push_back(std::abs(at->place_m - length_m[kBucket]));
  }
  Row models{{"tip_wrench", model_metrics(wrenches)},
             {"tip_force_of_two", model_metrics(forces)},
             {"force_and_position", model_metrics(places)}};
  models["tip_wrench"]["torque_Nm"] = metric(torque_Nm);
  models["force_and_position"]["place_error_m"] = metric(place_error_m);
  return models;
}

}  // namespace knuckle::studies
