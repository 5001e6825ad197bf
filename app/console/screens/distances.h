// How far the tip is from what matters: a ground that the person chose, the machine's virtual walls, and the place
// where it last touched something.
#pragma once

#include <array>
#include <cstddef>
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
class ContactTrail {
 public:
  static constexpr Duration kKept = 60s;   ///< Older points have faded.
  static constexpr double kApart = 0.015;  ///< Of the reach, at least, between points of one contact.
  static constexpr std::size_t kMost = 96;
  struct Point {
    PlanarVector at_m = PlanarVector::Zero();  ///< Frame M.
    Time at = kNever;                          ///< Of the session.
  };

  /// The tip touches something.
  struct Touch {
    Time at{};  ///< Of the session.
    PlanarVector tip_m = PlanarVector::Zero();
    bool apart = false;  ///< From the point before: it is the next one.
  };

  /// Only for current values. @param reach_m of the machine. @return what came of it; nullopt: it touches nothing.
  std::optional<Touch> watch(const ConsoleView& view, const Kinematics& kinematics, double reach_m);
  void add(const Touch& touch);
  void clear() { *this = {}; }
  /// Frame M; nothing before the first contact.
  [[nodiscard]] const std::optional<PlanarVector>& tip_m() const noexcept { return tip_m_; }
  /// In no order; some may never have been set.
  [[nodiscard]] const std::array<Point, kMost>& points() const noexcept { return points_; }
  /// 1: new, 0: too old to be shown.
  [[nodiscard]] static double freshness(const Point& point, Time now) noexcept;

 private:
  std::optional<PlanarVector> tip_m_;
  std::array<Point, kMost> points_{};
  std::size_t next_ = 0;
  bool touched_ = false;
};

struct Distance {
  const char* label;
  double m;
  bool has_sign = false;  ///< Which side of the line it is on.
};
/// Those that there are, the nearest virtual wall alone.
[[nodiscard]] std::vector<Distance> distances(const PlanarVector& tip_m, const Measures& by,
                                              const LimitsDescription& limits, const ContactTrail& last);

/// One below the other; nothing while the pose is not known.
void draw_distances(const widgets::Ui& ui, const ConsoleData& data, const UiState& state, const widgets::Area& area);

}  // namespace knuckle::console::screens
