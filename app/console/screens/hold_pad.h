// Leading without a keyboard: buttons over the picture that enable and move one joint for as long as they are held, by
// mouse or touch; and what turns them on.
#pragma once

#include "app/console/screens/console_data.h"
#include "app/console/screens/ui_state.h"

namespace knuckle::console::screens {

/// Over the picture, where the person leads by this window. Takes nothing of the picture while it is
/// off.
void draw_hold_pad(const widgets::Ui& ui, const ConsoleData& data, UiState& state, const widgets::Area& picture);

}  // namespace knuckle::console::screens
