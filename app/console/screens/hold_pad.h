// Leading without a keyboard: buttons below the picture that enable and move one joint for as long as they are held, by
// mouse or touch; and what turns them on.
#pragma once

#include "app/console/screens/console_data.h"
#include "app/console/screens/ui_state.h"

namespace knuckle::console::screens {

/// The person leads by this window.
[[nodiscard]] bool has_hold_pad(const ConsoleData& data);
/// Its switch among the tools, and its buttons. @param buttons empty: none.
void draw_hold_pad(const widgets::Ui& ui, const ConsoleData& data, UiState& state, const widgets::Area& tools,
                   const widgets::Area& buttons);

}  // namespace knuckle::console::screens
