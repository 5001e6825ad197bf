// Which of a sampled machine's errors costs what: truths that differ from the drawing in one respect alone.
#pragma once

#include <array>

#include "machine/description.h"
#include "sim/truth.h"

namespace knuckle::studies {

enum class ErrorSource : std::uint8_t {
  kNone,  ///< Nominal: what is left is LuGre against Dahl, cylinder masses, noise, quantisation, lags, hoses.
  kGeometry,
  kMasses,
  kFriction,
  kTransmitters,
  kSlope,     ///< Hull pitch and slope sensor.
  kEncoders,  ///< Offsets and noise.
  kValves,
  kOil,  ///< Viscosity, and other oil on the day of use.
};
inline constexpr std::array<const char*, 9> kErrorSourceNames{
    "nothing but noise", "pins and lengths", "masses", "friction", "pressure transmitters",
    "hull and slope",    "encoders",         "valves", "oil"};

/// The drawing with one kind of error of the sampled machine.
[[nodiscard]] sim::MachineTruth with_only(const MachineDescription& nominal, const sim::MachineTruth& sampled,
                                          ErrorSource source);

}  // namespace knuckle::studies
