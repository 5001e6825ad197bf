// What no residual of a fit can show: errors of sensors, lengths and the model that the parameters take up. Found by
// identifying the same recordings again with one of them at a time put on (type B uncertainties of JCGM 100:2008, 4.3;
// for the model, an allowance of ours).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
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
    kInput,  ///< A sensor or a length.
    kModel,  ///< The friction law or the weights. What friction parameters mean changes with it: only the base counts.
  } of;
  std::string name;                       ///< "gain of boom pressure A"
  std::function<void(FullInput&)> apply;  ///< Puts one standard deviation of it on; of kModel, all of it.
};

/// Transmitter gains and lag, slope sensor, compliance behind the encoders; lengths, which a survey has made smaller;
/// each term of the friction law the other way; rows weighted otherwise. Offsets of transmitters are not among them:
/// they are constant forces, which friction parameters take up. @param machine as calibrated().
[[nodiscard]] std::vector<UsualError> usual_errors(const MachineDescription& machine);

}  // namespace knuckle::estimation
