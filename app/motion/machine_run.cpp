#include "app/motion/machine_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>

#include "app/motion/path_leader.h"
#include "app/motion/transfer.h"
#include "core/error.h"
#include "core/loop_table.h"
#include "core/seed.h"
#include "estimation/identification/static_poses.h"
#include "machine/kinematics.h"
#include "sim/simulated_machine.h"
#include "slave/slave_loop.h"
#include "transport/canopen.h"
#include "transport/impaired_link.h"
#include "transport/virtual_can.h"

namespace knuckle::motion {
namespace {

constexpr Duration kComeUp = 10s, kSettle = 20s, kRestart = 2s, kSettled = 3s;  // patience
constexpr Duration kLoadComes = 500ms;
constexpr Duration kWatched = 1s;
// The arm swings on its oil after the valves have closed, by some hundred newtons at the cylinders; a small machine's
// by less than its encoders see, and within a second that falls to a quarter.
constexpr Duration kStill = 1500ms, kBeforeMoving = 500ms;
constexpr std::size_t kControllerPort = 0, kMachinePort = 1;

/// The encoders' own readings whatever the controller has learned of their offsets.
MachineDescription without_offsets(MachineDescription machine) {
  machine.sensors.encoder_offset_m.setZero();
  return machine;
}

TruthSample truth_of(const sim::PlantState& s) noexcept {
  return {s.joint_rad,  s.joint_radps, s.joint_radps2, s.cylinder_mps, s.lever_m,
          s.cylinder_N, s.friction_N,  s.tip_m,        s.tip_N,        s.payload_kg};
}

/// Where the simulated machine really has its joints and tip, frame M.
struct Points {
  PlanarVector arm_pin_m, bucket_pin_m, tip_m;
};

PlanarVector between(const std::vector<PlanarVector>& samples, double place) noexcept {
  const double bounded = std::clamp(place, 0.0, static_cast<double>(samples.size() - 1));
  const auto i = static_cast<std::size_t>(bounded);
  const auto next = std::min(i + 1, samples.size() - 1);
  return samples[i] + (bounded - static_cast<double>(i)) * (samples[next] - samples[i]);
}

}  // namespace

struct MachineRun::Impl {
  Impl(const MachineDescription& description, const sim::MachineTruth& truth, const sim::WorldDescription& world,
       const JointVector& start_rad, std::uint64_t seed);

  void tick();
  void run(Duration time);
  /// @throws std::runtime_error with `what` where `reached` does not come true in time.
  template <typename Condition>
  void run_until(Condition reached, Duration patience, const char* what);
  void on_frame(const CanFrame& frame) noexcept;
  void go_to(const JointVector& pose_rad);
  void stand(Duration still = kStill);
  void wait_until_still();
  void settle();
  void apply_pull() noexcept;
  void let_go() noexcept;
  [[nodiscard]] Points points() const noexcept;
  void sample();
  /// One sample of no use between two stops.
  static void part(MachineRecording& recording);
  /// Runs until so many more samples have been recorded.
  void record(MachineRecording& into, std::size_t count);
  [[nodiscard]] MachineRecording start_recording() const;
  [[nodiscard]] std::size_t samples_in(double duration_s) const noexcept;

  MachineDescription machine;
  Kinematics kinematics;
  Duration slave_period;
  std::uint64_t seed;
  std::mt19937_64 surveyor;  ///< His errors go on from survey to survey.
  Time now{};

  ImpairedLink link;
  VirtualCanBus bus;
  PathLeader leader;
  slave::SlaveLoop slave;
  sim::SimulatedMachine plant;
  slave::SensorSet raw;
  bool synchronised = false;  // a SYNC is on its way to the nodes: they sample at their next step
  TruthSample at_sampling;
  MachineRecording* recording = nullptr;
  const std::vector<PlanarVector>* pull = nullptr;  // of the test rig
  double pull_step_s = 0;
  Time pull_from = kNever;
  std::function<void(double)> watcher;
};

MachineRun::Impl::Impl(const MachineDescription& description, const sim::MachineTruth& truth,
                       const sim::WorldDescription& world, const JointVector& start_rad, std::uint64_t run_seed)
    : machine(description),
      kinematics(description),
      slave_period(from_seconds(1 / description.bus.sync_Hz)),
      seed(run_seed),
      surveyor(stream_seed(run_seed, Stream::kSurvey)),
      link({}, {}, run_seed),
      bus(2, description.bus.bit_rate),
      leader(link.a()),
      slave(description, bus.port(kControllerPort), link.b()),
      plant(truth, world, start_rad, bus.port(kMachinePort), run_seed),
      raw(without_offsets(description)) {
  if (slave_period % kTick != Duration::zero()) {
    throw InputError(machine.source + ": key 'bus.sync_Hz' = " + std::to_string(machine.bus.sync_Hz) +
                     ": its period must be whole milliseconds");
  }
  bus.set_tap({[](void* self, Time, const CanFrame& f) { static_cast<Impl*>(self)->on_frame(f); }, this});
  run_until([this] { return leader.engaged(); }, kComeUp, "the machine does not engage");
}

void MachineRun::Impl::on_frame(const CanFrame& frame) noexcept {
  raw.receive(frame, now);
  synchronised |= frame.id == canopen::kSyncId;
}

void MachineRun::Impl::tick() {
  now += kTick;
  link.advance(now);
  leader.step(now);
  bus.advance(now);
  if (pull != nullptr) apply_pull();
  if (now.time_since_epoch() % slave_period == Duration::zero()) sample();
  plant.step(now);
  if (watcher && now.time_since_epoch() % kWatched == Duration::zero()) watcher(to_seconds(now));
  if (synchronised) {
    at_sampling = truth_of(plant.plant().state());
    synchronised = false;
  }
  if (!leader.dropped_out()) return;
  recording = nullptr;
  throw std::runtime_error("the machine has dropped out: " + text(leader.trouble()));
}

void MachineRun::Impl::sample() {
  const JointVector on_the_wire = slave.client().demand();  // while the sensors were sampled, one step ago
  slave.step(now);
  const auto measured = slave.sensors().measurement();
  const auto read = raw.measurement();
  if (recording == nullptr || !measured || !read) return;
  estimation::Recording& into = recording->recording;
  into.samples.push_back(*measured);
  into.samples.back().cylinder_m = read->cylinder_m;
  into.usable.push_back(1);
  into.valve.push_back(on_the_wire);
  recording->truth.push_back(at_sampling);
}

void MachineRun::Impl::run(Duration time) {
  for (const Time end = now + time; now < end;) tick();
}

template <typename Condition>
void MachineRun::Impl::run_until(Condition reached, Duration patience, const char* what) {
  for (const Time end = now + patience; !reached(); tick()) {
    if (now < end) continue;
    const Reason reason = leader.trouble();
    throw std::runtime_error(what + (reason ? ": " + text(reason) : std::string()));
  }
}

void MachineRun::Impl::stand(Duration still) {
  leader.stand();
  run_until([&] { return leader.at_rest(now, still); }, kSettle, "the machine does not come to rest");
}

/// Until no rod moves any more as static identification sees it: a big machine with its arm stretched out swings by
/// millimetres, at 3 Hz, for seconds. Twice as long as a rest must last: the last of a swing looks still for one. One
/// that goes on for longer is not waited for.
void MachineRun::Impl::wait_until_still() {
  const estimation::StaticOptions rest;
  const double most_m = estimation::still_m(machine);
  JointVector low = JointVector::Constant(std::numeric_limits<double>::infinity()), high = -low;
  Time since = now;
  for (const Time end = now + kSettle; now < end && to_seconds(now - since) < 2 * rest.rest_s; tick()) {
    const auto read = raw.measurement();
    if (!read) continue;
    low = low.cwiseMin(read->cylinder_m);
    high = high.cwiseMax(read->cylinder_m);
    if ((high - low).maxCoeff() <= most_m) continue;
    low = high = read->cylinder_m;
    since = now;
  }
}

void MachineRun::Impl::go_to(const JointVector& pose_rad) {
  stand(kBeforeMoving);
  const JointVector from = leader.machine()->position_rad;
  leader.follow(transfer(machine, kinematics, from, pose_rad, to_seconds(slave_period)));
  run_until([this] { return leader.engaged(); }, kRestart, "the machine is not engaged again");
  run_until([this] { return leader.done(now); }, Duration::max() / 2, "");
}

/// Stays engaged at the end of the way; a controller that keeps hunting there is not waited for.
void MachineRun::Impl::settle() {
  for (const Time end = now + kSettled; now < end && !leader.at_rest(now);) tick();
}

void MachineRun::Impl::apply_pull() noexcept {
  plant.plant().set_tip_load(between(*pull, to_seconds(now - pull_from) / pull_step_s));
}

void MachineRun::Impl::let_go() noexcept {
  pull = nullptr;
  plant.plant().set_tip_load(PlanarVector::Zero());
}

Points MachineRun::Impl::points() const noexcept {
  const sim::PlantState& state = plant.plant().state();
  const auto& links = plant.plant().truth().machine.links;
  const auto along = [&](int joint) {
    const double angle = state.joint_rad.head(joint + 1).sum();
    return PlanarVector(links[static_cast<std::size_t>(joint)].length_m *
                        PlanarVector(std::cos(angle), std::sin(angle)));
  };
  const PlanarVector arm_pin = along(kBoom), bucket_pin = arm_pin + along(kArm);
  return {arm_pin, bucket_pin, state.tip_m};
}

void MachineRun::Impl::part(MachineRecording& recording) {
  estimation::Recording& r = recording.recording;
  r.samples.push_back(r.samples.back());
  r.valve.push_back(r.valve.back());
  r.usable.push_back(0);
  recording.truth.push_back(recording.truth.back());
}

std::size_t MachineRun::Impl::samples_in(double duration_s) const noexcept {
  return static_cast<std::size_t>(std::lround(duration_s * machine.bus.sync_Hz));
}

MachineRecording MachineRun::Impl::start_recording() const {
  MachineRecording made;
  made.recording.source = machine.name + ", simulated, seed " + std::to_string(seed);
  made.recording.step_s = to_seconds(slave_period);
  return made;
}

void MachineRun::Impl::record(MachineRecording& into, std::size_t count) {
  const std::size_t wanted = into.recording.samples.size() + count;
  recording = &into;
  while (into.recording.samples.size() < wanted) tick();
  recording = nullptr;
}

MachineRun::MachineRun(const MachineDescription& machine, const sim::MachineTruth& truth,
                       const sim::WorldDescription& world, const JointVector& start_rad, std::uint64_t seed)
    : impl_(std::make_unique<Impl>(machine, truth, world, start_rad, seed)) {}
MachineRun::~MachineRun() = default;

void MachineRun::watch(std::function<void(double elapsed_s)> watcher) {
  impl_->watcher = std::move(watcher);
}

MachineRecording MachineRun::follow(const estimation::JointPath& path, const std::vector<PlanarVector>& pull_N) {
  Impl& i = *impl_;
  if (path.joint_rad.empty()) throw std::invalid_argument("a path must have a point");
  if (!pull_N.empty() && pull_N.size() != path.joint_rad.size()) {
    throw std::invalid_argument("a pull must have one force a sample of the path");
  }
  i.go_to(path.joint_rad.front());
  i.settle();
  MachineRecording made = i.start_recording();
  i.leader.follow(path);
  i.pull = pull_N.empty() ? nullptr : &pull_N;
  i.pull_step_s = path.step_s;
  i.pull_from = i.now + kTick;
  i.record(made, i.samples_in(path.duration_s()));
  i.let_go();
  return made;
}

MachineRecording MachineRun::rest(double duration_s) {
  MachineRecording made = impl_->start_recording();
  impl_->stand();
  impl_->record(made, impl_->samples_in(duration_s));
  return made;
}

void MachineRun::hang(double mass_kg) {
  impl_->leader.stand();
  impl_->plant.plant().hang(mass_kg);
  impl_->run(kLoadComes);
  impl_->stand();
}

MachineRecording MachineRun::stops(const std::vector<JointVector>& poses_rad, double duration_s) {
  MachineRecording made = impl_->start_recording();
  for (const JointVector& pose : poses_rad) {
    impl_->go_to(pose);
    impl_->stand();
    impl_->wait_until_still();
    if (!made.truth.empty()) impl_->part(made);
    impl_->record(made, impl_->samples_in(duration_s));
  }
  return made;
}

estimation::Survey MachineRun::survey(const std::vector<JointVector>& poses_rad, double sigma_m) {
  estimation::Survey survey;
  survey.source = impl_->start_recording().recording.source;
  survey.point_sigma_m = sigma_m;
  std::normal_distribution<> error;
  const auto seen = [&](const PlanarVector& point) {
    const double x = error(impl_->surveyor), z = error(impl_->surveyor);
    return PlanarVector(point + sigma_m * PlanarVector(x, z));
  };
  for (const JointVector& pose : poses_rad) {
    impl_->go_to(pose);
    impl_->stand();
    const Points points = impl_->points();
    survey.poses.push_back({impl_->raw.measurement().value().cylinder_m, seen(points.arm_pin_m),
                            seen(points.bucket_pin_m), seen(points.tip_m)});
  }
  return survey;
}

}  // namespace knuckle::motion
