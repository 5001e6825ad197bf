// Why the force is not known better, in words.
#include <utility>

#include "estimation/force_estimator.h"

namespace knuckle::estimation {

std::string doubt_text(std::uint8_t confidence_reasons) {
  constexpr std::array<std::pair<ConfidenceReason, const char*>, 8> kWords{
      {{kBadInput, "sensor values are not usable"},
       {kNearSingular, "arm near straight or bucket near its end"},
       {kResidual, "the joints disagree: contact elsewhere than at the tip, or a sensor error"},
       {kEndStop, "a cylinder is at its end stop"},
       {kReliefOpen, "a relief valve is open"},
       {kStuckFriction, "at rest: friction hides small forces"},
       {kFastMotion, "fast motion"},
       {kBiasNotLearned, "still learning this machine's free motion"}}};
  std::string words;
  for (const auto& [bit, why] : kWords)
    if ((confidence_reasons & bit) != 0) words += (words.empty() ? "" : ", ") + std::string(why);
  return words;
}

}  // namespace knuckle::estimation
