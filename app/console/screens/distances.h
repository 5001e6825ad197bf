// How far the tip is from what matters: a ground that the person chose, the machine's virtual walls, and the place
// where it last touched something.
#pragma once

#include <optional>
#include <vector>

#include "app/console/console_view.h"
#include "app/console/screens/ui_state.h"
#include "app/console/widgets/widgets.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::console::screens {

struct ConsoleData;

/// Remembers where the tip last was in contact.
class LastContact {
 public:
  /// Only for current values.
  void watch(const ConsoleView& view, const Kinematics& kinematics);
  void clear() { tip_m_.reset(); }
  /// Frame M; nothing before the first contact.
  [[nodiscard]] const std::optional<PlanarVector>& tip_m() const noexcept { return tip_m_; }

 private:
  std::optional<PlanarVector> tip_m_;
};

struct Distance {
  const char* label;
  double m;
};
/// Those that there are, the nearest virtual wall alone. @param ground_m height of the chosen ground, frame M.
[[nodiscard]] std::vector<Distance> distances(const PlanarVector& tip_m, double ground_m,
                                              const LimitsDescription& limits, const LastContact& last);

/// So that words can be read over a camera's picture.
void draw_backdrop(const widgets::Ui& ui, const widgets::Area& area);
/// Into the upper left of the picture; nothing while the pose is not known.
void draw_distances(const widgets::Ui& ui, const ConsoleData& data, const UiState& state, const widgets::Area& picture);

}  // namespace knuckle::console::screens
