// Leads a machine along paths through the link, as an operator would, on a real or a simulated bus: slave loop, safety
// gate and frames are those of every session. What is recorded is what its sensors report.
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "estimation/identification/excitation.h"
#include "estimation/identification/recording.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "slave/slave_loop.h"
#include "transport/bus_access.h"
#include "transport/impaired_link.h"
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

/// The machine did not do in time what was waited for, or is no longer engaged; what() gives the reason.
class NotLed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Time passes in its calls only; each of them but neutral() may throw NotLed.
class LedMachine {
 public:
  /// @param access outlives this. @param first_step of the slave loop; a period of 1 / sync_Hz from one to the next.
  LedMachine(const MachineDescription& machine, BusAccess& access, Time first_step);

  /// Called after every step of the slave loop; may throw to end what is under way.
  std::function<void()> each_step = [] {};

  /// From reset to engaged, where the machine stands.
  void engage();
  /// Waits where it was led to, engaged, until every joint has been still for so long.
  void rest(Duration still);
  /// The same, but not for longer than `patience`: a controller may go on hunting there.
  void settle(Duration still, Duration patience);
  /// Waits with closed valves until every joint has been still for so long.
  void stand(Duration still);
  /// Waits with closed valves for so long.
  void pause(Duration time);
  /// Stands, then goes gently to the pose and stays there, engaged.
  void go_to(const JointVector& pose_rad);
  /// Goes on as it is. @param reached asked every millisecond. @return false where it was not within `patience`.
  bool run_until(const std::function<bool()>& reached, Duration patience);
  /// Leads along the path, which begins where the machine is, while time passes in calls to come.
  void lead(const estimation::JointPath& path) { leader_.follow(path); }
  /// The path's end has been reached by the set-points.
  [[nodiscard]] bool done() const noexcept { return leader_.done(access_.now()); }
  /// A millisecond. @return whether the slave loop has stepped and a sample was added, with the encoders' raw readings.
  bool record(estimation::Recording& into);
  /// Waits with closed valves, pilot pressure still on; for the way out, before an orderly stop.
  void neutral() noexcept;

  [[nodiscard]] Duration period() const noexcept { return period_; }  ///< Of the slave loop.
  [[nodiscard]] const slave::SlaveLoop& slave() const noexcept { return slave_; }

 private:
  /// A millisecond. @return whether the slave loop has stepped.
  bool advance();
  /// The same, and each_step. @throws NotLed where the machine is no longer engaged.
  bool tick();
  [[nodiscard]] bool rests(Duration still, Duration patience);
  void require(bool reached, const char* otherwise) const;

  MachineDescription machine_;
  Kinematics kinematics_;
  BusAccess& access_;
  Duration period_;
  Time step_due_;
  ImpairedLink link_;
  PathLeader leader_;
  slave::SlaveLoop slave_;
  slave::SetupFailure setup_failure_;  // the last one since it engaged: a loop that tries again forgets its own
};

}  // namespace knuckle::motion
