#include "app/console/calibration_job.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include "app/bringup/commission_wizard.h"
#include "app/cli/output_file.h"
#include "app/identify/calibration_file.h"
#include "app/identify/commission.h"
#include "app/identify/identify.h"
#include "app/identify/identify_data.h"
#include "app/identify/identify_output.h"
#include "core/error.h"
#include "estimation/regressor.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "machine/pose.h"
#include "machine/toml_reader.h"
#include "machine/whole_file.h"
#include "sim/machine_on_bus.h"

namespace knuckle::console {
namespace {

namespace fs = std::filesystem;
constexpr double kJudged_Hz = 2;          // as identify judges held-out torque
constexpr std::size_t kTellingPoses = 3;  // with fewer, nothing can be separated
constexpr auto kIdle = std::chrono::milliseconds(20);

/// Simulated time no faster than `pace` times the wall's.
class Pacer {
 public:
  explicit Pacer(double pace) : pace_(pace), began_(std::chrono::steady_clock::now()) {}
  void wait(Time now) const {
    if (pace_ <= 0 || now.time_since_epoch() % kGrain != Duration::zero()) return;
    std::this_thread::sleep_until(began_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                               std::chrono::duration<double>(to_seconds(now) / pace_)));
  }

 private:
  static constexpr Duration kGrain = 20ms;
  double pace_;
  std::chrono::steady_clock::time_point began_;
};

/// @return the file itself where the target is a link. @throws InputError where no file can come to be there.
std::string file_of(const std::string& target) {
  std::error_code ignored;  // a link to itself, say: it is not there
  const bool there = fs::exists(target, ignored);
  if (there && !fs::is_regular_file(target)) throw InputError(target + ": cannot be written: is not a regular file");
  if (!there && fs::is_symlink(target, ignored))
    throw InputError(target + ": cannot be written: is a link to a file that does not exist");
  return there ? fs::canonical(target).string() : target;
}

/// Error on the held-out motion of a calibration that is in use; nullopt where there is none.
std::optional<JointVector> old_nrmse(const MachineDescription& before, const estimation::Recording& recording) {
  if (!before.dynamics_calibration) return std::nullopt;
  const auto comparison = estimation::compare_torque(*before.dynamics_calibration, calibrated(before), recording,
                                                     estimation::FullOptions{});
  return estimation::torque_fit(comparison, kJudged_Hz).nrmse;
}

/// How well the poses so far separate the links' weights: condition number of the column-scaled gravity regressor.
/// nullopt where a reading is no angle of this arm, or there are fewer rows than weights.
std::optional<double> gravity_condition(const Kinematics& kinematics, const estimation::Survey& survey) {
  constexpr int kMoments = estimation::kBaseParameters - estimation::kMomentX;
  if (kJoints * survey.poses.size() < kMoments) return std::nullopt;
  Eigen::MatrixXd rows(kJoints * static_cast<int>(survey.poses.size()), kMoments);
  for (std::size_t p = 0; p < survey.poses.size(); ++p) {
    JointVector joints_rad;
    for (int j = 0; j < kJoints; ++j) {
      const auto angle = kinematics.joint_at(j, survey.poses[p].cylinder_m[j]);
      if (!angle) return std::nullopt;
      joints_rad[j] = *angle;
    }
    rows.middleRows<kJoints>(kJoints * static_cast<int>(p)) =
        estimation::RigidArm::gravity(estimation::Pose(joints_rad, 0)).rightCols<kMoments>();
  }
  rows.array().rowwise() /= rows.colwise().norm().array().max(1e-12).eval();
  const Eigen::VectorXd singular = rows.jacobiSvd().singularValues();
  return singular[0] / std::max(singular[kMoments - 1], 1e-12);
}

CalibrationStage stage_of(int step) {
  constexpr int kSteps = 7;
  return static_cast<CalibrationStage>(std::clamp(step, 1, kSteps) - 1);
}

}  // namespace

CalibrationJob::CalibrationJob(CalibrationPlan plan)
    : plan_(std::move(plan)), machine_file_(find_config("machine", plan_.machine)) {
  // All that can be refused is refused before the work is done.
  (void)load_machine(machine_file_);
  plan_.target = file_of(plan_.target);
  { const cli::OutputFile writable("calibrated machine file", plan_.target); }
  before_ = load_machine(fs::exists(plan_.target) ? plan_.target : machine_file_);
  thread_ = std::thread([this] { run(); });
}

CalibrationJob::~CalibrationJob() {
  cancel();
  thread_.join();
}

template <typename Change>
void CalibrationJob::change(Change change) {
  const std::lock_guard lock(mutex_);
  change(state_);
  ++version_;
}

std::optional<CalibrationState> CalibrationJob::newer(std::uint64_t& seen) const {
  const std::lock_guard lock(mutex_);
  if (seen == version_) return std::nullopt;
  seen = version_;
  return state_;
}

void CalibrationJob::answer(const std::string& word) {
  change([&](CalibrationState& state) {
    state.question.reset();
    answers_.push_back(word);
  });
}

void CalibrationJob::cancel() {
  cancelled_ = true;
}

void CalibrationJob::accept() {
  const std::lock_guard lock(mutex_);
  decision_ = Decision::kAccept;
}

void CalibrationJob::discard() {
  const std::lock_guard lock(mutex_);
  decision_ = Decision::kDiscard;
}

void CalibrationJob::check() const {
  if (cancelled_) throw bringup::CommissionEnded("cancelled");
}

std::optional<std::string> CalibrationJob::poll() {
  check();
  const std::lock_guard lock(mutex_);
  if (answers_.empty()) return std::nullopt;
  std::string word = std::move(answers_.front());
  answers_.erase(answers_.begin());
  return word;
}

void CalibrationJob::run() {
  std::string outcome;
  try {
    commission();
    identify_and_decide();
    return;
  } catch (const std::exception& ended) {
    outcome = std::string("ended, nothing was changed: ") + ended.what();
  }
  change([&](CalibrationState& state) {
    state.stage = CalibrationStage::kOver;
    state.question.reset();
    state.outcome = outcome;
  });
}

/// The wizard's partner: what it says goes into the state, buttons answer.
bringup::Partner CalibrationJob::screen() {
  const auto say = [this](const std::string& line) {
    if (!line.empty()) change([&](CalibrationState& state) { state.said.push_back(line); });
  };
  bringup::Partner partner;
  partner.say = say;
  partner.begin = [this, say](int step, const std::string& title) {
    say(std::to_string(step) + ". " + title);
    change([&](CalibrationState& state) { state.stage = stage_of(step); });
  };
  partner.ask = [this, say](const bringup::Question& question) {
    say(text(question));
    change([&](CalibrationState& state) { state.question = question; });
  };
  partner.poll = [this] { return poll(); };
  partner.live = true;
  partner.stop_gesture = "the button End";
  return partner;
}

void CalibrationJob::commission() {
  const MachineDescription nominal = load_machine(machine_file_);
  const MachineDescription machine = calibrated(nominal);
  const auto simulated = std::make_shared<sim::MachineOnBus>(
      sim::sample_truth(nominal, plan_.seed), sim::WorldDescription{}, middle_of_range(machine), plan_.seed);
  const Pacer pacer(plan_.pace);
  simulated->each_tick = [&](sim::MachineOnBus& machine_now) {
    poses_.put(machine_now.plant().joint_rad);
    pacer.wait(machine_now.now());
  };
  BusAccess access = sim::access_to(simulated);
  bool recorded = false;
  const auto record = [&recorded](const MachineDescription&, const std::function<bool()>&) {
    recorded = true;  // driven below, where poses and motions can be watched
    return std::vector<std::string>{};
  };
  (void)bringup::run_wizard(machine, access, screen(), record, [this] { check(); });
  if (!recorded) throw bringup::CommissionEnded("finished before identification");
}

CalibrationJob::Decision CalibrationJob::wait_for_decision() const {
  for (;; std::this_thread::sleep_for(kIdle)) {
    check();
    const std::lock_guard lock(mutex_);
    if (decision_ != Decision::kNone) return decision_;
  }
}

void CalibrationJob::identify_and_decide() {
  identify::IdentifyOptions options;
  options.machine = machine_file_;
  options.simulate = true;
  options.seed = plan_.seed;
  options.slow_s = plan_.slow_s;
  options.fast_s = plan_.fast_s;
  const Kinematics kinematics(calibrated(load_machine(machine_file_)));
  const auto driven = [this](double share) {
    check();
    change([&](CalibrationState& state) { state.done = share; });
  };
  const auto posed = [&](const estimation::Survey& survey) {
    check();
    const auto condition = gravity_condition(kinematics, survey);
    const std::size_t all = identify::commission_plan(options).survey_poses;
    change([&](CalibrationState& state) {
      state.poses = survey.poses.size();
      if (condition && state.poses >= kTellingPoses) state.condition_numbers.push_back(*condition);
      if (state.poses == all) state.stage = CalibrationStage::kDynamics;
    });
  };
  change([](CalibrationState& state) { state.stage = CalibrationStage::kPoses; });
  const identify::IdentifyData data = identify::drive_for_data(options, driven, posed);
  change([](CalibrationState& state) {
    state.stage = CalibrationStage::kHoldOut;
    state.done = 0;
  });
  const identify::Identified result = identify::identify(data, "full", {}, driven);
  change([&](CalibrationState& state) {
    for (std::size_t i = 0; i < data.hold_out.size(); ++i) {
      HoldOutRow row{data.hold_out[i].source, {}, old_nrmse(before_, data.hold_out[i])};
      for (const identify::HoldOut& held : result.hold_out)
        if (held.method == result.method && held.source == row.recording) row.new_nrmse = held.judged().nrmse;
      state.hold_out.push_back(row);
    }
    state.usable = result.summary.usable;
    state.verdict = identify::verdict(result);
    state.stage = CalibrationStage::kDecision;
  });
  const bool wanted = wait_for_decision() == Decision::kAccept && result.summary.usable;
  std::optional<Acceptance> accepted;
  if (wanted) {
    const std::string kept = identify::write_calibrated_machine(result.machine, plan_.target);
    accepted = {plan_.target, kept, whole_file(plan_.target, kLargestToml_MB)};
  }
  change([&](CalibrationState& state) {
    state.stage = CalibrationStage::kOver;
    state.accepted = accepted;
    state.outcome = "discarded: nothing was changed";
    if (!accepted) return;
    state.outcome = "accepted: " + accepted->file;
    if (!accepted->kept.empty()) state.outcome += ", the previous file is kept as " + accepted->kept;
  });
}

std::string roll_back(const Acceptance& accepted) {
  if (whole_file(accepted.file, kLargestToml_MB) != accepted.content)
    throw InputError(accepted.file + ": not rolled back: the file has changed since it was accepted");
  const std::string kept = cli::keep_older(accepted.file);
  std::error_code error;
  if (accepted.kept.empty()) {
    fs::remove(accepted.file, error);
  } else {
    fs::rename(accepted.kept, accepted.file, error);
  }
  if (!error) return kept;
  std::error_code ignored;
  fs::remove(kept, ignored);
  throw InputError(accepted.file + ": cannot be rolled back: " + error.message());
}

}  // namespace knuckle::console
