#include "app/window/screens.h"

namespace knuckle::app {

void calibrate_screen(const Ui& ui, const Area& area) {
  const Card card(ui, "CALIBRATE", area);
  put_lines(ui.theme.fonts.body, ui.theme.colours.text, card.inside(),
            "Calibration is done from the command line: `knuckle commission` leads through the first motions of a "
            "machine, `knuckle identify` turns recordings into a calibrated machine file.");
}

}  // namespace knuckle::app
