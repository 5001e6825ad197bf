// What heights in the picture are measured from, as the person chose it: a ground, and a grade line that is worked to;
// and how far the tip is from these, from the machine's virtual walls, and from where it last touched something.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/console/console_view.h"
#include "app/console/widgets/widgets.h"
#include "core/joints.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::console::screens {

struct ConsoleData;

/// A line that is worked to, in the arm's plane; frame M.
struct GradeLine {
  PlanarVector point_m = PlanarVector::Zero();  ///< One that it passes through.
  double slope = 0;                             ///< Rise by metre forward.
  [[nodiscard]] double height_m(double forward_m) const { return point_m.y() + slope * (forward_m - point_m.x()); }
};

/// What heights are measured from, as the person chose it.
struct Measures {
  std::optional<double> ground_m;  ///< Frame M; where the tip touched the ground. None: the boom's pin.
  GradeLine grade;
  bool grade_on = false;
  /// What the tip's place is to be taken for, once.
  enum class Take : std::uint8_t { kNothing, kGround, kGradePoint, kGradeSlope };
  Take take = Take::kNothing;
  bool typed = false;      ///< Into one of its number fields, in the frame drawn last.
  bool has_point = false;  ///< The line goes through a place where the tip was.
  std::string said;        ///< What of the last wish was not done, in one line, for a while.
  double said_s = -1;      ///< Since when, by the window's clock; negative: not shown yet.
  [[nodiscard]] double zero_m() const { return ground_m.value_or(0); }
  /// Takes it, if anything. A slope needs a point that was taken, and a tip that is ahead of or behind it.
  void take_tip(const PlanarVector& tip_m);
  /// Where the tip is is not known: nothing is taken now, nor later.
  void drop();
  void say(const std::string& line);
};

/// The grade line's settings, below the other switches; each can be typed or taken from where the tip is.
void draw_grade_panel(const Ui& ui, Measures& measures, const Area& tools);
/// What was not done, at the top of the area; leaves the rest of it.
void draw_said(const Ui& ui, Measures& measures, Area& area);
/// How far the tip is from everything, one below the other; nothing while the pose is not known.
void draw_distances(const Ui& ui, const ConsoleData& data, const Measures& measures, const Area& area);

// How far the tip is from what matters.

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

}  // namespace knuckle::console::screens
