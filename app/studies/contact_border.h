// The borders of the machine-side contact loop as the simulated machine shows them: up to where a hold calms down again
// after a small step.
#pragma once

#include <string>

#include "app/studies/contact_model.h"
#include "app/studies/contact_run.h"

namespace knuckle::studies {

enum class Valves : std::uint8_t {
  kIdeal,  ///< Without dead band, hysteresis, dither and learning, encoders without steps, little noise: small signals.
  kAsOnFile,  ///< As the machine file says, known to the controller.
};

/// The machine file with valves as asked. The controller's and the simulated machine's own.
[[nodiscard]] MachineDescription with_valves(const MachineDescription& machine, Valves valves);

/// What one run shows after its step.
struct HoldSwing {
  double early_N = 0, late_N = 0;  ///< Peak to peak of a sine of the same power, drift left out; the worse component.
  double frequency_Hz = 0;         ///< Of that component, late.
  double peak_N = 0;               ///< Largest push until the step.
  int bounces = 0;                 ///< Losses of contact between touch and step.
  std::string trouble;             ///< ContactRecord::trouble
  bool calm = false;               ///< late < 0.5 of the step, or < 0.6 of early; and the machine stayed engaged.
  ContactHold hold;                ///< Means of the late part.
};
[[nodiscard]] HoldSwing judge_hold(const ContactTrial& trial, const ContactRecord& record);

/// Bisection by ratio to within 3 %.
struct MeasuredBorder {
  bool found = false;                  ///< false: calm to the end of the range, where no border is.
  double value = 0, frequency_Hz = 0;  ///< Of the swing next to it.
  HoldSwing calm;                      ///< Next to it, or at the end of the range.
};
/// The softest calm Ks without bound of the crossover, from 8e3 N/m on.
[[nodiscard]] MeasuredBorder measure_stiffness_border(ContactTrial trial);
/// The largest calm contact_crossover_radps at the Ks of the trial, up to kFastest_radps.
[[nodiscard]] MeasuredBorder measure_crossover_border(ContactTrial trial);

}  // namespace knuckle::studies
