#include "app/console/console_view.h"

#include "app/console/named_fields.h"

namespace knuckle::console {

OperatorSide operator_side(const master::MasterState& state, double position_scale, double force_scale) noexcept {
  OperatorSide side;
  make_unknown(side);
  copy_named(state, side);
  if (state.other_machine) side.device = state.other_machine;
  side.position_scale = state.settings.position_scale > 0 ? state.settings.position_scale : position_scale;
  side.force_scale = state.settings.force_scale > 0 ? state.settings.force_scale : force_scale;
  side.assist = state.settings.assist;
  side.hand_energy_J = state.energy_out_J - state.energy_in_J;
  return side;
}

}  // namespace knuckle::console
