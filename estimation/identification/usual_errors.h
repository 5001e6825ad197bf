// What no residual of a fit can show: errors of sensors, lengths and the model that the parameters take up. Found by
// identifying the same recordings again with each of them as large as it usually is (JCGM 100:2008, type B
// uncertainties of 4.3, sensitivities by numerical change of 5.1.3 note 2).
#pragma once

#include <functional>
#include <vector>

#include "estimation/identification/full.h"
#include "estimation/identification/recording.h"
#include "machine/description.h"

namespace knuckle::estimation {

/// All that `full` identifies from.
struct FullInput {
  MachineDescription machine;  ///< As calibrated().
  std::vector<Recording> recordings;
  FullOptions options;
};

struct UsualError {
  enum class Of : std::uint8_t {
    kInput,  ///< A sensor or a length: moves all parameters alike.
    kModel,  ///< The friction law or the weights: what friction parameters mean changes with it, so only the base
             ///< counts.
  } of;
  std::function<void(FullInput&)> apply;  ///< Puts one standard deviation of it on.
};

/// Transmitter gains and lag, slope sensor, compliance behind the encoders; lengths, which a survey has made smaller;
/// each term of the friction law left out; rows weighted otherwise. @param machine as calibrated().
[[nodiscard]] std::vector<UsualError> usual_errors(const MachineDescription& machine);

}  // namespace knuckle::estimation
