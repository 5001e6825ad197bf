// Leads a machine along a given motion through the link, as an operator with a device would: presses enable, stays
// where the machine is until it is engaged, then sends set-points. It knows nothing but the link's messages, so it can
// lead any machine that speaks them.
#pragma once

#include <optional>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "estimation/identification/excitation.h"
#include "transport/link.h"
#include "transport/link_messages.h"
#include "transport/link_session.h"

namespace knuckle::motion {

class PathLeader {
 public:
  /// @param link the operator's end; must outlive the leader. @param start drawn anew for each leader.
  PathLeader(Link& link, const LinkStart& start) noexcept : link_(link), session_(start, kRestartSilence) {}

  /// Hears the machine and sends what is due (500 Hz). Call every millisecond.
  void step(Time now) noexcept;

  /// Leads along the path once the machine is engaged, then stays at its end. The machine must be near its first point.
  void follow(const estimation::JointPath& path);
  /// The machine waits where it is, valves neutral, until the next follow().
  void stand() noexcept;

  /// Newest message; nullopt before the first.
  [[nodiscard]] const std::optional<SlaveMessage>& machine() const noexcept { return machine_; }
  [[nodiscard]] bool engaged() const noexcept { return machine_ && machine_->mode == Mode::kEngaged; }
  /// The path's end has been reached by the set-points; false while the machine waits to be engaged.
  [[nodiscard]] bool done(Time now) const noexcept;
  /// Every joint has stayed within a few milliradians for so long.
  [[nodiscard]] bool at_rest(Time now, Duration time = 500ms) const noexcept;
  /// Why the machine is not led: before it is engaged what is in the way, after it why it has dropped out; kNone while
  /// it is led or stands as asked.
  [[nodiscard]] Reason trouble() const noexcept;
  /// Whether the machine was led and is not any more.
  [[nodiscard]] bool dropped_out() const noexcept { return led_ && trouble(); }
  [[nodiscard]] const JointVector& set_point_rad() const noexcept { return sent_.position_rad; }

 private:
  void hear(Time now) noexcept;
  void lead(Time now) noexcept;
  void send(Time now) noexcept;

  Link& link_;
  LinkSession session_;
  estimation::JointPath path_;
  std::optional<SlaveMessage> machine_;
  Time sent_at_ = kNever, started_at_ = kNever;
  bool led_ = false;  // engaged before
  JointVector smooth_rad_ = JointVector::Zero(), rest_rad_ = JointVector::Zero();
  Time rest_since_ = kNever;
  MasterMessage sent_;
};

/// Where a path is at t_s after its first sample, and how fast: cubic through the samples, at rest beyond its end.
struct PathPoint {
  JointVector joint_rad, joint_radps;
};
[[nodiscard]] PathPoint point_at(const estimation::JointPath& path, double t_s) noexcept;

}  // namespace knuckle::motion
