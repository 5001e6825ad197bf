// The border of the machine-side contact loop as the simulated machine shows it: the softest give-way whose hold calms
// down again after a small step.
#pragma once

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
  double touch_mps = 0;            ///< Speed into the wall at the first touch.
  double peak_N = 0;               ///< Largest push until the step.
  int bounces = 0;                 ///< Losses of contact between touch and step.
  bool calm = false;               ///< late < 0.5 of the step, or < 0.6 of early; and the machine stayed engaged.
  ContactHold hold;                ///< Means of the late part.
};
[[nodiscard]] HoldSwing judge_hold(const ContactTrial& trial, const ContactRecord& record);

struct MeasuredBorder {
  double stiffness_N_per_m = 0;  ///< Between the softest calm Ks and the stiffest that is not.
  HoldSwing calm, swinging;      ///< Next to it.
};
/// Bisection of Ks by ratio to within 3 %, between 1e3 and 1e6 N/m.
[[nodiscard]] MeasuredBorder measure_border(ContactTrial trial);

}  // namespace knuckle::studies
