#include "sim/operator.h"

#include <cmath>
#include <numbers>

#include "core/seed.h"
#include "machine/description.h"

namespace knuckle::sim {
namespace {

constexpr double kToAnEnd = 1.0 / 3;   // of stretches
constexpr double kSlowestShare = 0.2;  // of the fastest: speeds are drawn by ratio
constexpr double kLongestPause_s = 2;  // every other stretch has one
constexpr double kShortestStretch_s = 0.5;

}  // namespace

Wander::Wander(std::uint64_t seed, const JointVector& low_rad, const JointVector& high_rad)
    : random_(stream_seed(seed, Stream::kWander)), low_rad_(low_rad), high_rad_(high_rad) {}

void Wander::begin(const JointVector& from_rad, double fastest_radps) noexcept {
  fastest_radps_ = fastest_radps;
  meant_rad_ = from_rad;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double angle = from_rad[static_cast<Eigen::Index>(i)];
    stretches_[i] = {angle, angle, 0, 0, 0};
  }
}

Wander::Stretch Wander::drawn(int joint, double from_rad, double t_s) noexcept {
  const double low = low_rad_[joint], high = high_rad_[joint];
  const double kind = unit_interval(random_), place = unit_interval(random_);
  const double to_rad = kind < kToAnEnd / 2 ? low : kind < kToAnEnd ? high : low + place * (high - low);
  const double peak_radps = fastest_radps_ * std::pow(kSlowestShare, unit_interval(random_));
  const double length_s = std::max(kShortestStretch_s, kPeakOfMinimumJerk * std::abs(to_rad - from_rad) / peak_radps);
  const double pause_s = kLongestPause_s * std::max(0.0, 2 * unit_interval(random_) - 1);
  return {from_rad, to_rad, t_s, t_s + length_s, t_s + length_s + pause_s};
}

const JointVector& Wander::step(double t_s, bool going_on) noexcept {
  at_rest_ = true;
  for (int joint = 0; joint < kJoints; ++joint) {
    Stretch& stretch = stretches_[static_cast<std::size_t>(joint)];
    if (going_on && t_s >= stretch.until_s) stretch = drawn(joint, stretch.to_rad, t_s);
    const double length_s = std::max(1e-9, stretch.end_s - stretch.begin_s);
    const double share = minimum_jerk((t_s - stretch.begin_s) / length_s);
    meant_rad_[joint] = stretch.from_rad + share * (stretch.to_rad - stretch.from_rad);
    at_rest_ = at_rest_ && t_s >= stretch.end_s;
  }
  return meant_rad_;
}

namespace {

constexpr double kTouch_N = 0.35;         // felt at the hand: "there is something"
constexpr double kAlignRate_radps = 0.6;  // how fast a hand is brought to the machine's pose at most,
constexpr double kAlignGain_1ps = 4;      // slowing down as it comes near
constexpr double kAligned_rad = 0.05;
constexpr double kMostCorrection_rad = 0.6;  // a hand that is held back so far is pulled at no further
constexpr double kPressGain_1ps = 2;         // of the missing force, made up for per second: slow enough for the delay
constexpr double kPressFastest_mps = 1.0;    // push once there is contact, machine metres
constexpr double kMuscles_s = 0.1;           // from meaning to push to pushing
constexpr double kBreakRamp_Nps = 0.25;      // a hand that wants something to give way pushes harder and harder
constexpr Duration kHesitate = 300ms;        // before a button is pressed
constexpr Duration kRetry = 1500ms;          // enable is let go again when nothing came of it
constexpr Duration kViewPeriod = 5ms;
constexpr double kShortestMove_s = 0.5;
constexpr double kToPath_radps = 0.25;  // from where the hand is to the start of a recording
constexpr double kShortestToPath_s = 1;
constexpr double kClutchIn_s = 0.5;   // held before the hand moves,
constexpr double kClutchOut_s = 0.8;  // held after it has moved, and then waited: the picture is late

double wrapped(double angle) noexcept {
  return std::remainder(angle, 2 * std::numbers::pi);
}

}  // namespace

PushStiffness push_stiffness(const LimbImpedance& limb, const DeviceDescription::Feel& feel) noexcept {
  const double k = limb.stiffness_N_per_m, spring = feel.spring_N_per_m;
  return {k / feel.position_scale, k * spring / (k + spring) / feel.position_scale};
}

Operator::Operator(const MachineDescription& machine, std::vector<Phase> phases, std::vector<PathPoint> path,
                   Duration path_period, const JointVector& start_rad, Duration reaction, const PushStiffness& push,
                   const Unsteadiness& unsteadiness, std::uint64_t seed)
    : phases_(std::move(phases)),
      path_(std::move(path)),
      path_period_(path_period),
      reaction_(std::min(reaction, Duration(kViewPeriod * (kRing - 1)))),
      push_(push),
      unsteadiness_(unsteadiness),
      correction_1ps_(unsteadiness.person().corrects
                          ? std::min(sim::correction_1ps(reaction), unsteadiness.steady_below_1ps())
                          : 0),
      carried_out_rad_(start_rad),
      meant_rad_(start_rad),
      start_rad_(start_rad),
      hand_start_rad_(start_rad) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto j = static_cast<Eigen::Index>(i);
    links_m_[j] = machine.links[i].length_m;
    min_rad_[j] = machine.links[i].min_rad;
    max_rad_[j] = machine.links[i].max_rad;
  }
  wander_ = Wander(seed, min_rad_, max_rad_);
  intent_.joint_rad = start_rad;
}

Operator::Pose Operator::pose_of(const JointVector& q) const noexcept {
  const double a = q[0], b = a + q[1], c = b + q[2];
  return {links_m_[0] * PlanarVector(std::cos(a), std::sin(a)) + links_m_[1] * PlanarVector(std::cos(b), std::sin(b)) +
              links_m_[2] * PlanarVector(std::cos(c), std::sin(c)),
          c};
}

bool Operator::inverse(const Pose& pose, JointVector& joints) const noexcept {
  const double l1 = links_m_[0], l2 = links_m_[1];
  const PlanarVector pin =
      pose.tip_m - links_m_[2] * PlanarVector(std::cos(pose.bucket_rad), std::sin(pose.bucket_rad));
  const double cosine = (pin.squaredNorm() - l1 * l1 - l2 * l2) / (2 * l1 * l2);
  if (!(std::abs(cosine) < 1)) return false;
  joints[kArm] = -std::acos(cosine);
  joints[kBoom] =
      std::atan2(pin.y(), pin.x()) - std::atan2(l2 * std::sin(joints[kArm]), l1 + l2 * std::cos(joints[kArm]));
  joints[kBucket] = wrapped(pose.bucket_rad - joints[kBoom] - joints[kArm]);
  // Buckets turn further inwards than outwards: where both turns are meant, the inward one is in range.
  if (joints[kBucket] > max_rad_[kBucket] + 1) joints[kBucket] -= 2 * std::numbers::pi;
  return true;
}

void Operator::mean(const Pose& pose) noexcept {
  JointVector joints;
  if (!inverse(pose, joints)) return;  // out of reach: the hand stays where it meant to be
  mean(joints.cwiseMax(min_rad_).cwiseMin(max_rad_));
}

void Operator::begin(Time now, const OperatorView& view) noexcept {
  begun_ = true;
  phase_start_ = now;
  offset_ = view.ghost_rad - view.hand_rad;
  // An operator who never looks takes the hand to be where it was meant to be. One who looks starts from what is
  // shown, and has nothing left to correct of the phase before.
  for (std::size_t i = 0; i < kRing; ++i) meant_then_rad_[i] = seen_[i].ghost_rad;
  meant_rad_ = looks() ? view.ghost_rad : JointVector(intent_.joint_rad + offset_);
  correction_rad_ = intent_.joint_rad + offset_ - meant_rad_;
  start_rad_ = meant_rad_;
  hand_start_rad_ = intent_.joint_rad;
  start_pose_ = pose_of(meant_rad_);
  if (!finished()) wander_.begin(start_rad_, phases_[index_].speed_mps);
  depth_m_ = touch_depth_m_ = 0;
  touched_ = holding_ = false;
  breaks_at_start_ = view.breaks;
  pressed_at_ = engaged_since_ = kNever;
  calm_since_ = now;
}

void Operator::next(Time now) noexcept {
  ++index_;
  begun_ = holding_ = false;
  phase_start_ = now;
  intent_.clutch = false;
  pushing_N_.setZero();
}

OperatorIntent Operator::step(Time now, const OperatorView& view) noexcept {
  if (now - last_seen_ >= kViewPeriod) {
    meant_then_rad_[seen_count_ % kRing] = begun_ && watches() ? meant_rad_ : view.ghost_rad;
    seen_[seen_count_++ % kRing] = view;
    last_seen_ = now;
  }
  const auto late = std::min<std::size_t>(static_cast<std::size_t>(reaction_ / kViewPeriod), seen_count_ - 1);
  const std::size_t at = (seen_count_ - 1 - late) % kRing;
  const OperatorView& seen = seen_[at];
  const double dt = to_seconds(now - last_);
  if (!finished()) {
    if (!begun_) begin(now, view);
    if (watches()) correct(meant_then_rad_[at], seen, std::max(0.0, dt));
    const bool expired = to_seconds(now - phase_start_) > phases_[index_].timeout_s;
    if (expired && timed_out_ < 0) timed_out_ = phase();
    if (run(now, seen) || expired) next(now);
  }
  last_ = now;
  return carried_out(now, dt);
}

bool Operator::watches() const noexcept {
  if (!looks() || finished()) return false;
  switch (phases_[index_].kind) {
    case PhaseKind::kMove:
    case PhaseKind::kSweep:
    case PhaseKind::kPath:
    case PhaseKind::kWait:
    case PhaseKind::kWander:
      return true;
    case PhaseKind::kPress:
      return !touched_;       // from then on it is felt what to do
    case PhaseKind::kEngage:  // has its own way of looking
    case PhaseKind::kLetGo:
    case PhaseKind::kClutch:
    case PhaseKind::kHome:
      return false;
  }
  return false;
}

void Operator::correct(const JointVector& meant_then_rad, const OperatorView& seen, double dt_s) noexcept {
  const JointVector more = dt_s * correction_1ps_ * (meant_then_rad - seen.ghost_rad);
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    const double most = std::max(kMostCorrection_rad, std::abs(correction_rad_[i]));
    correction_rad_[i] = std::clamp(correction_rad_[i] + more[i], -most, most);
  }
}

OperatorIntent Operator::carried_out(Time now, double dt_s) noexcept {
  OperatorIntent out = intent_;
  unsteadiness_.step(now);
  out.joint_rad += unsteadiness_.drift_rad();
  out.grip = unsteadiness_.grip();
  pushed_N_ += (pushing_N_ - pushed_N_) * -std::expm1(-std::max(0.0, dt_s) / kMuscles_s);
  out.push_N = out.grip * (unsteadiness_.push_N() + pushed_N_);
  out.rate_radps = dt_s > 0 ? JointVector((out.joint_rad - carried_out_rad_) / dt_s) : JointVector(JointVector::Zero());
  carried_out_rad_ = out.joint_rad;
  return out;
}

bool Operator::run(Time now, const OperatorView& view) noexcept {
  const Phase& phase = phases_[index_];
  const double t = to_seconds(now - phase_start_);
  const bool stopped = view.mode == Mode::kFault || view.mode == Mode::kEStop;
  bool done = false;
  switch (phase.kind) {
    case PhaseKind::kEngage:
      return engage(now, view);
    case PhaseKind::kLetGo:
      intent_.enable = false;
      return t >= phase.duration_s;
    case PhaseKind::kMove:
      done = move(t, view);
      break;
    case PhaseKind::kPress:
      done = press(now, view);
      break;
    case PhaseKind::kSweep:
      done = sweep(t);
      break;
    case PhaseKind::kPath:
      done = follow_path(t);
      break;
    case PhaseKind::kClutch:
      return clutch(t);
    case PhaseKind::kHome:
      return choose_home(now, view);
    case PhaseKind::kWait:
      done = t >= phase.duration_s;
      break;
    case PhaseKind::kWander:
      mean(wander_.step(t, t < phase.duration_s));
      done = t >= phase.duration_s && wander_.at_rest();
      break;
  }
  if (phase.until_hold) done = view.mode == Mode::kHold;
  if (phase.until_fault) done = t >= phase.duration_s && stopped;
  intent_.joint_rad = meant_rad_ - offset_ + correction_rad_;
  return done;
}

bool Operator::engage(Time now, const OperatorView& view) noexcept {
  intent_.presence = true;
  intent_.clutch = false;
  const double dt = std::max(0.0, to_seconds(now - last_));
  const bool shown = view.mode != Mode::kOff && view.mode != Mode::kSelfTest;
  if (!shown) return false;  // nothing to steer by yet
  offset_ = view.ghost_rad - view.hand_rad;
  const JointVector goal = view.machine_rad - offset_;
  const JointVector missing = goal - (looks() ? view.hand_rad : intent_.joint_rad);
  const double gain_1ps = looks() ? std::min(kAlignGain_1ps, correction_1ps_) : kAlignGain_1ps;
  const JointVector stride =
      dt * JointVector(gain_1ps * missing).cwiseMax(-kAlignRate_radps).cwiseMin(kAlignRate_radps);
  if (!intent_.enable || view.mode != Mode::kEngaged) intent_.joint_rad += stride;
  if (view.mode == Mode::kEngaged && intent_.enable) {
    if (engaged_since_ == kNever) engaged_since_ = now;
    return now - engaged_since_ >= kHesitate;
  }
  engaged_since_ = kNever;
  const bool aligned = missing.cwiseAbs().maxCoeff() < kAligned_rad;
  if (!aligned) calm_since_ = now;
  if (intent_.enable && now - pressed_at_ > kRetry) {
    intent_.enable = false;
    calm_since_ = now;
  } else if (!intent_.enable && aligned && now - calm_since_ > 2 * kHesitate) {
    intent_.enable = true;
    pressed_at_ = now;
  }
  return false;
}

/// Enable is pressed and released while the fault is shown; then the clutch is held until that is taken.
bool Operator::choose_home(Time now, const OperatorView& view) noexcept {
  intent_.presence = true;
  intent_.clutch = view.home_offered && !intent_.enable;
  if (view.home_on_two || view.home_offered) {
    intent_.enable = false;
    return view.home_on_two;
  }
  const Duration since = now - std::max(phase_start_, pressed_at_);
  if (since < (intent_.enable ? kHesitate : kRetry)) return false;
  intent_.enable = !intent_.enable;
  pressed_at_ = now;
  return false;
}

bool Operator::move(double t, const OperatorView& view) noexcept {
  const Phase& phase = phases_[index_];
  JointVector target = phase.joints_rad;
  Pose goal{phase.tip_m, phase.bucket_rad};
  if (!phase.joint_space && !inverse(goal, target)) return true;
  // Duration from the longer of the tip's way and the joints' ways, so that a turn on the spot is not a jerk.
  const double way = phase.joint_space ? (target - start_rad_).cwiseAbs().maxCoeff()
                                       : std::max((goal.tip_m - start_pose_.tip_m).norm(),
                                                  links_m_[2] * (target - start_rad_).cwiseAbs().maxCoeff());
  const double duration = std::max(kShortestMove_s, kPeakOfMinimumJerk * way / phase.speed_mps);
  const double s = minimum_jerk(t / duration);
  if (phase.joint_space) {
    mean(JointVector(start_rad_ + s * (target - start_rad_)));
  } else {
    const double turn = wrapped(goal.bucket_rad - start_pose_.bucket_rad);
    mean(Pose{start_pose_.tip_m + s * (goal.tip_m - start_pose_.tip_m), start_pose_.bucket_rad + s * turn});
  }
  if (t < duration) return false;
  return (pose_of(view.machine_rad).tip_m - pose_of(meant_rad_).tip_m).norm() < phase.tolerance_m;
}

bool Operator::press(Time now, const OperatorView& view) noexcept {
  const Phase& phase = phases_[index_];
  const double dt = std::max(0.0, to_seconds(now - last_));
  const double felt = -view.felt_N.dot(phase.direction);
  if (phase.until_break && (view.breaks > breaks_at_start_ || view.breaks >= phase.pieces)) return true;
  if (!touched_) {
    depth_m_ += phase.speed_mps * dt;
    touch_depth_m_ = depth_m_;
    if (felt > kTouch_N) {
      touched_ = true;
      hold_start_ = now;
    }
  } else if (!holding_) {
    const double ramp = phase.until_break ? kBreakRamp_Nps * to_seconds(now - hold_start_) : 0.0;
    const double missing = phase.force_N + ramp - felt;
    depth_m_ += std::clamp(kPressGain_1ps * missing / push_.felt_N_per_m, -kPressFastest_mps, kPressFastest_mps) * dt;
    if (!phase.until_break && missing < 0.05 * phase.force_N) {
      holding_ = true;
      hold_start_ = now;
      hold_depth_m_ = depth_m_;
    }
  } else if (const Person& person = unsteadiness_.person(); person.give_way > 0) {
    const double lost = person.give_way * (1 - std::exp(-to_seconds(now - hold_start_) / person.give_way_s));
    depth_m_ = hold_depth_m_ - lost * phase.force_N / push_.felt_N_per_m;
  }
  // What is pressed against is not gone through: beyond the touch muscles push, as a hand does that is meant further
  // in.
  pushing_N_ = push_.limb_N_per_m * (depth_m_ - touch_depth_m_) * phase.direction;
  mean(Pose{start_pose_.tip_m + touch_depth_m_ * phase.direction, start_pose_.bucket_rad});
  return holding_ && to_seconds(now - hold_start_) >= phase.duration_s;
}

bool Operator::sweep(double t) noexcept {
  const Phase& phase = phases_[index_];
  const double fade = minimum_jerk(t / 2) * minimum_jerk((phase.duration_s - t) / 2);
  JointVector joints = start_rad_;
  for (int i = 0; i < kJoints; ++i) {
    joints[i] += fade * phase.joints_rad[i] * std::sin(2 * std::numbers::pi * t / phase.periods_s[i]);
  }
  mean(joints);
  return t >= phase.duration_s;
}

bool Operator::follow_path(double t) noexcept {
  if (path_.empty()) return true;
  // From where the hand is to the path's start first, then along it.
  const JointVector missing = path_.front().joints_rad - start_rad_;
  const double approach =
      std::max(kShortestToPath_s, kPeakOfMinimumJerk * missing.cwiseAbs().maxCoeff() / kToPath_radps);
  if (t < approach) {
    mean(JointVector(start_rad_ + minimum_jerk(t / approach) * missing));
    return false;
  }
  const double index = (t - approach) / to_seconds(path_period_);
  const auto i = static_cast<std::size_t>(index);
  if (i + 1 >= path_.size()) {
    mean(path_.back().joints_rad);
    return true;
  }
  const double f = index - static_cast<double>(i);
  mean(JointVector((1 - f) * path_[i].joints_rad + f * path_[i + 1].joints_rad));
  return false;
}

bool Operator::clutch(double t) noexcept {
  const Phase& phase = phases_[index_];
  const double way = phase.joints_rad.cwiseAbs().maxCoeff();
  const double moving = std::max(kShortestMove_s, kPeakOfMinimumJerk * way / kAlignRate_radps);
  const double moved = kClutchIn_s + moving;
  intent_.clutch = t < moved + kClutchOut_s;
  intent_.joint_rad = hand_start_rad_ + minimum_jerk((t - kClutchIn_s) / moving) * phase.joints_rad;
  return t >= moved + 2 * kClutchOut_s;
}

}  // namespace knuckle::sim
