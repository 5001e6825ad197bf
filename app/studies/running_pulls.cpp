#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/interrupt.h"
#include "app/motion/machine_run.h"
#include "app/studies/battery_machine.h"
#include "app/studies/force_scores.h"
#include "app/studies/test_rig.h"
#include "core/seed.h"
#include "core/units.h"
#include "estimation/identification/excitation.h"
#include "estimation/line_of_action.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "slave/slave_state.h"

namespace knuckle::studies {
namespace {

constexpr double kWarmUp_s = 20;
constexpr double kInterval = 1.96;              // standard deviations of 95 %
constexpr double kSteepest_rad = 60 * kDegree;  // off the side's normal
constexpr double kGoodTorque_Nm = 40, kGoodTorqueShare = 0.15;
constexpr std::size_t kLinkageSide = 3;  // rods and pins lie before it: nothing is pushed there
constexpr std::uint16_t kRefusals = estimation::kStraightArm | estimation::kBucketInLine | estimation::kNearToggle |
                                    estimation::kDirectionAlongLink | estimation::kOffTheBucket |
                                    estimation::kNoDirection;

struct Told {
  slave::SlaveState state;
  motion::TruthSample truth;
  [[nodiscard]] bool answered() const { return (state.confidence_reasons & kRefusals) == 0; }
  [[nodiscard]] PlanarVector force_N() const { return state.tip_force_N + state.load_N; }
  [[nodiscard]] Eigen::Matrix2d covariance_N2() const {
    const auto& [xx, xz, zz] = state.covariance_N2;
    return Eigen::Matrix2d{{xx, xz}, {xz, zz}};
  }
};

/// A side of the bucket's outline, bucket axes, from the tip.
struct Side {
  PlanarVector from_m, to_m;
  [[nodiscard]] PlanarVector at(double share) const { return from_m + share * (to_m - from_m); }
  /// In which direction the world pushes on it.
  [[nodiscard]] PlanarVector inward() const {
    const PlanarVector along = (to_m - from_m).normalized();
    return {-along.y(), along.x()};
  }
};

double angle_of(const PlanarVector& v) {
  return std::atan2(v.y(), v.x());
}

class RunningPulls {
 public:
  RunningPulls(const MachineDescription& machine, const sim::MachineTruth& truth, std::uint64_t seed)
      : machine_(machine),
        seed_(seed),
        tells_place_(machine.force.contact_model != ContactModel::kTipForceOfTwo),
        rig_(machine, truth.hull, 1 / machine.bus.sync_Hz, stream_seed(seed, Stream::kLoads)),
        run_(machine, truth, {}, middle_of_range(machine), stream_seed(seed, Stream::kUse)) {
    run_.watch([](double) { cli::check_interrupt(); });
    run_.listen([this](const slave::SlaveState& state, const motion::TruthSample& truth_sample) {
      told_.push_back({state, truth_sample});
    });
    const auto outline = bucket_outline(truth.machine);
    for (std::size_t i = 0; i < outline.size(); ++i)
      sides_[i] = {outline[i] - outline[0], outline[(i + 1) % outline.size()] - outline[0]};
  }

  void move_freely(double each_s) {
    follow_free(estimation::MotionSpeed::kDigging, Stream::kWarmUp, kWarmUp_s);
    for (const auto& [speed, stream] : {std::pair{estimation::MotionSpeed::kSlow, Stream::kSlow},
                                        {estimation::MotionSpeed::kDigging, Stream::kDigging}}) {
      follow_free(speed, stream, each_s);
      judge_free();
    }
  }

  /// All directions in one pose, which is drawn again where it holds hardly anything in one of them.
  void pull_at_tip(const std::vector<double>& directions_rad) {
    JointVector pose;
    std::vector<PlanarVector> pulls_N;
    for (std::size_t held = 0; held < directions_rad.size();) {
      if (held == 0) {
        pose = rig_.pose();
        pulls_N.clear();
      }
      const auto pull_N = rig_.pull(pose, directions_rad[held]);
      held = pull_N ? held + 1 : 0;
      if (pull_N) pulls_N.push_back(*pull_N);
    }
    PullPath path(pose, rig_.step_s());
    const JointVector end = rig_.crept(pose, rig_.pose());
    for (const PlanarVector& pull_N : pulls_N) path.pull(pull_N, std::nullopt);
    for (std::size_t i = 0; i < pulls_N.size(); ++i) path.pull(pulls_N[i], i % 2 == 0 ? end : pose);
    follow(path, PlanarVector::Zero());
    for (const Press& press : path.presses()) judge_at_tip(press);
  }

  /// On every side that can be touched, in one pose.
  void push_on_sides() {
    for (std::size_t side = 0; side < sides_.size(); ++side) {
      if (side != kLinkageSide) push_on(side);
    }
  }

  [[nodiscard]] Row metrics() {
    Row row;
    add_presses(presses_, row);
    for (const auto& [name, values] : lists_) row[name] = metric(values);
    row["free_covered"] = {free_.covered, free_.looks};
    row["free_torque_covered"] = {free_.torque_covered, free_.looks};
    row["false_alarms"] = {free_.alarms, free_.time_s};
    return row;
  }

 private:
  void follow_free(estimation::MotionSpeed speed, Stream stream, double duration_s) {
    told_.clear();
    (void)run_.follow(estimation::held_out_motion(machine_, stream_seed(seed_, stream), speed, duration_s));
  }
  void follow(const PullPath& path, const PlanarVector& from_tip_m) {
    told_.clear();
    (void)run_.follow(path.path(), path.pull_N(), from_tip_m);
  }
  void list(const std::string& name, double value) { lists_[name].push_back(value); }
  void list(const std::string& name, bool good) { lists_[name].push_back(good ? 1 : 0); }

  void judge_free() {
    constexpr double settle_s = 1, look_every_s = 0.5;
    const auto settle = static_cast<std::size_t>(settle_s / rig_.step_s());
    const auto every = static_cast<std::size_t>(look_every_s / rig_.step_s());
    for (std::size_t k = settle; k < told_.size(); ++k) {
      const Told& told = told_[k];
      free_.alarms += told.state.contact && !told_[k - 1].state.contact ? 1 : 0;
      if (k % every != 0 || !told.answered()) continue;
      ++free_.looks;
      free_.covered += inside_95(told.force_N(), told.covariance_N2()) ? 1 : 0;
      free_.torque_covered += std::abs(told.state.tip_torque_Nm) <= kInterval * told.state.tip_torque_sigma_Nm ? 1 : 0;
      if (tells_place_) list("free_torque_Nm", std::abs(told.state.tip_torque_Nm));
    }
    free_.time_s += static_cast<double>(told_.size() - settle) * rig_.step_s();
  }

  /// Of the mean over the end of the hold. A pull that is refused in it has no answer.
  [[nodiscard]] PressScore score(const Press& press) const {
    PlanarVector truth = PlanarVector::Zero(), told = PlanarVector::Zero();
    bool answered = true;
    for (std::size_t k = press.judge_from; k < press.judge_to; ++k) {
      truth += told_[k].truth.contact_N;
      told += told_[k].force_N();
      answered = answered && told_[k].answered();
    }
    const double n = static_cast<double>(press.judge_to - press.judge_from);
    PressScore score =
        score_pull(truth / n, answered ? PlanarVector(told / n) : PlanarVector::Constant(kUnknown), press.creeping);
    score.taken_for_load_N = told_[press.judge_to - 1].state.load_N.norm();
    return score;
  }

  void judge_at_tip(const Press& press) {
    presses_.push_back(score(press));
    const bool answered = !std::isnan(presses_.back().error_N);
    list("answered", answered);
    if (!answered) return;
    const Told& last = told_[press.judge_to - 1];
    list("press_covered", inside_95(last.force_N() - last.truth.contact_N, last.covariance_N2()));
    if (tells_place_) judge_line("tip", last, 0);
  }

  /// What is told of more than the force, against the true torque about the tip. A force that is too small has no line.
  void judge_line(const std::string& where, const Told& told, double torque_Nm) {
    const slave::SlaveState& state = told.state;
    list(where + "_torque_error_Nm", std::abs(state.tip_torque_Nm - torque_Nm));
    list(where + "_torque_covered", std::abs(state.tip_torque_Nm - torque_Nm) <= kInterval * state.tip_torque_sigma_Nm);
    if (state.line_sigma_m == 0) return;
    const double off_m = std::abs(state.line_offset_m + torque_Nm / told.truth.contact_N.norm());
    list(where + "_offset_m", off_m);
    list(where + "_offset_covered", off_m <= kInterval * state.line_sigma_m);
  }

  void push_on(std::size_t side) {
    JointVector pose;
    PlanarVector at_m;
    std::optional<PlanarVector> push_N;
    while (!push_N) {
      pose = rig_.pose();
      at_m = sides_[side].at(rig_.sampler().within(0.1, 0.9));
      const double off_rad = rig_.sampler().within(-kSteepest_rad, kSteepest_rad);
      push_N = rig_.pull(pose, angle_of(sides_[side].inward()) + pose.sum() + off_rad, at_m);
    }
    PullPath path(pose, rig_.step_s());
    path.pull(*push_N, std::nullopt);
    path.pull(*push_N, rig_.crept(pose, rig_.pose()));
    follow(path, at_m);
    for (const Press& press : path.presses()) judge_beside(press, side, at_m);
  }

  void judge_beside(const Press& press, std::size_t side, const PlanarVector& at_m) {
    const PressScore pushed = score(press);
    if (std::isnan(pushed.error_N)) return;
    const Told& last = told_[press.judge_to - 1];
    const Eigen::Rotation2Dd to_machine(last.truth.joint_rad.sum());
    const PlanarVector& truth_N = last.truth.contact_N;
    const double torque_Nm = cross(to_machine * at_m, truth_N);
    const double error_Nm = std::abs(last.state.tip_torque_Nm - torque_Nm);
    list("beside_error_N", pushed.error_N);
    list("beside_covered", inside_95(last.force_N() - truth_N, last.covariance_N2()));
    if (!tells_place_) return;
    list("beside_torque_good", error_Nm <= std::max(kGoodTorque_Nm, kGoodTorqueShare * std::abs(torque_Nm)));
    judge_line("beside", last, torque_Nm);
    // The bucket turns while it creeps.
    if (truth_N.normalized().dot(to_machine * sides_[side].inward()) < std::cos(kSteepest_rad)) return;
    const bool right = last.state.touched_share[side] > 0.5;
    list("side_right", right);
    list(std::string("side_right.") + estimation::kBucketSideNames[side], right);
  }

  MachineDescription machine_;
  std::uint64_t seed_;
  bool tells_place_;  // else the force is taken to be at the tip
  Rig rig_;
  motion::MachineRun run_;
  std::array<Side, estimation::kBucketSides> sides_;
  std::vector<Told> told_;  // in the newest run
  std::vector<PressScore> presses_;
  std::map<std::string, std::vector<double>> lists_;
  struct Free {
    int alarms = 0, looks = 0, covered = 0, torque_covered = 0;
    double time_s = 0;
  } free_;
};

}  // namespace

Row score_running(MachineDescription machine, const sim::MachineTruth& truth, ContactModel model, const PullPlan& plan,
                  std::uint64_t seed) {
  constexpr double kTurn = 2 * std::numbers::pi;
  const bool along_one = model == ContactModel::kForceAndPosition;
  const double first_rad = along_one ? kTurn / 12 * static_cast<double>(seed % 6) : 0;
  std::vector<double> directions_rad;
  for (int i = 0; i < plan.directions; ++i)
    directions_rad.push_back(first_rad + (along_one ? kTurn / 2 * (i % 2) : kTurn * i / plan.directions));
  machine.force.contact_model = model;
  if (along_one) {
    machine.force.direction = ForceDirection::kFixed;
    machine.force.fixed_direction = {std::cos(first_rad), std::sin(first_rad)};
  }
  RunningPulls pulls(machine, truth, seed);
  pulls.move_freely(plan.free_s);
  for (int i = 0; i < plan.poses; ++i) pulls.pull_at_tip(directions_rad);
  for (int i = 0; i < plan.push_poses && !along_one; ++i) pulls.push_on_sides();
  return pulls.metrics();
}

}  // namespace knuckle::studies
