#include "app/motion/machine_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>

#include "app/motion/led_machine.h"
#include "core/loop_table.h"
#include "core/seed.h"
#include "estimation/identification/static_poses.h"
#include "sim/machine_on_bus.h"
#include "slave/sensors.h"
#include "transport/canopen.h"

namespace knuckle::motion {
namespace {

constexpr Duration kSettled = 500ms, kSettling = 3s, kLoadComes = 500ms, kSwinging = 20s;
constexpr Duration kWatched = 1s;
// The arm swings on its oil after the valves have closed, by some hundred newtons at the cylinders; a small machine's
// by less than its encoders see, and within a second that falls to a quarter.
constexpr Duration kStill = 1500ms;

/// The encoders' own readings whatever the controller has learned of their offsets.
MachineDescription without_offsets(MachineDescription machine) {
  machine.sensors.encoder_offset_m.setZero();
  return machine;
}

TruthSample truth_of(const sim::PlantState& s) noexcept {
  return {s.joint_rad,  s.joint_radps, s.joint_radps2, s.cylinder_mps, s.lever_m,
          s.cylinder_N, s.friction_N,  s.tip_m,        s.contact_N,    s.payload_kg};
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

  /// The machine's time passes, tick by tick. @return due
  Time wait(Time due);
  void on_frame(const CanFrame& frame) noexcept;
  /// As the encoders report them, known offsets not taken off. Every sensor has been heard since it was engaged.
  [[nodiscard]] JointVector reading_m() const { return raw.measurement().value().cylinder_m; }
  void wait_until_still();
  [[nodiscard]] Points points() noexcept;
  /// One sample of no use between two stops.
  static void part(MachineRecording& recording);
  /// Runs until so many more samples have been recorded.
  void record(MachineRecording& into, std::size_t count);
  [[nodiscard]] MachineRecording start_recording() const;
  [[nodiscard]] std::size_t samples_in(double duration_s) const noexcept;

  MachineDescription machine;
  std::uint64_t seed;
  std::mt19937_64 surveyor;  ///< His errors go on from survey to survey.
  Time now{};

  slave::SensorSet raw;
  // A SYNC is on its way to the nodes: they sample at their next step. Without nodes any frame: what the machine sends
  // by itself is of its moment.
  bool synchronised = false;
  bool without_nodes;
  TruthSample at_sampling;
  std::function<void(const slave::SlaveState&, const TruthSample&)> listener;
  const std::vector<PlanarVector>* pull = nullptr;  // of the test rig
  PlanarVector pull_at_m = PlanarVector::Zero();    // bucket axes
  double pull_step_s = 0;
  Time pull_from = kNever;

  sim::MachineOnBus simulated;
  BusAccess access;
  LedMachine led;
};

MachineRun::Impl::Impl(const MachineDescription& description, const sim::MachineTruth& truth,
                       const sim::WorldDescription& world, const JointVector& start_rad, std::uint64_t run_seed)
    : machine(description),
      seed(run_seed),
      surveyor(stream_seed(run_seed, Stream::kSurvey)),
      raw(without_offsets(description)),
      without_nodes(description.bus.without_nodes()),
      simulated(truth, world, start_rad, run_seed),
      access("simulated bus", {std::shared_ptr<void>(), &simulated.controllers_end()},
             [this](Time due) { return wait(due); }),
      led(description, access, Time(sim::period_in_ticks(description))) {
  simulated.set_tap({[](void* self, Time, const CanFrame& f) { static_cast<Impl*>(self)->on_frame(f); }, this});
  led.engage();
}

void MachineRun::Impl::on_frame(const CanFrame& frame) noexcept {
  raw.receive(frame, now);
  synchronised |= without_nodes || frame.id == canopen::kSyncId;
}

Time MachineRun::Impl::wait(Time due) {
  while (now < due) {
    now += kTick;
    sim::Plant& plant = simulated.machine().plant();
    if (pull != nullptr) {
      plant.set_pull(between(*pull, to_seconds(now - pull_from) / pull_step_s), pull_at_m);
    }
    simulated.step(now);
    if (std::exchange(synchronised, false)) at_sampling = truth_of(plant.state());
  }
  return now;
}

/// Until no rod moves any more as static identification sees it: a big machine with its arm stretched out swings by
/// millimetres, at 3 Hz, for seconds. Twice as long as a rest must last: the last of a swing looks still for one. One
/// that goes on for longer is not waited for.
void MachineRun::Impl::wait_until_still() {
  const estimation::StaticOptions rest;
  const double most_m = estimation::still_m(machine);
  JointVector low = JointVector::Constant(std::numeric_limits<double>::infinity()), high = -low;
  Time since = now;
  const auto still = [&] {
    if (to_seconds(now - since) >= 2 * rest.rest_s) return true;
    const JointVector read_m = reading_m();
    low = low.cwiseMin(read_m);
    high = high.cwiseMax(read_m);
    if ((high - low).maxCoeff() <= most_m) return false;
    low = high = read_m;
    since = now;
    return false;
  };
  (void)led.run_until(still, kSwinging);
}

Points MachineRun::Impl::points() noexcept {
  const sim::PlantState& state = simulated.plant();
  const auto& links = simulated.machine().plant().truth().machine.links;
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
  made.recording.step_s = to_seconds(led.period());
  return made;
}

void MachineRun::Impl::record(MachineRecording& into, std::size_t count) {
  auto& samples = into.recording.samples;
  for (const std::size_t wanted = samples.size() + count; samples.size() < wanted;) {
    if (!led.record(into.recording)) continue;
    samples.back().cylinder_m = reading_m();
    into.truth.push_back(at_sampling);
    if (listener) listener(slave::state_of(now, led.slave()), at_sampling);
  }
}

MachineRun::MachineRun(const MachineDescription& machine, const sim::MachineTruth& truth,
                       const sim::WorldDescription& world, const JointVector& start_rad, std::uint64_t seed)
    : impl_(std::make_unique<Impl>(machine, truth, world, start_rad, seed)) {}
MachineRun::~MachineRun() = default;

void MachineRun::watch(std::function<void(double elapsed_s)> watcher) {
  impl_->led.each_step = [&i = *impl_, watcher = std::move(watcher)] {
    if (i.now.time_since_epoch() % kWatched < i.led.period()) watcher(to_seconds(i.now));
  };
}

void MachineRun::listen(std::function<void(const slave::SlaveState&, const TruthSample&)> listener) {
  impl_->listener = std::move(listener);
}

MachineRecording MachineRun::follow(const estimation::JointPath& path, const std::vector<PlanarVector>& pull_N,
                                    const PlanarVector& pull_from_tip_m) {
  Impl& i = *impl_;
  if (path.joint_rad.empty()) throw std::invalid_argument("a path must have a point");
  if (!pull_N.empty() && pull_N.size() != path.joint_rad.size()) {
    throw std::invalid_argument("a pull must have one force a sample of the path");
  }
  i.led.go_to(path.joint_rad.front());
  i.led.settle(kSettled, kSettling);
  MachineRecording made = i.start_recording();
  i.led.lead(path);
  i.pull = pull_N.empty() ? nullptr : &pull_N;
  i.pull_at_m =
      PlanarVector(i.simulated.machine().plant().truth().machine.links[kBucket].length_m, 0) + pull_from_tip_m;
  i.pull_step_s = path.step_s;
  i.pull_from = i.now + kTick;
  i.record(made, i.samples_in(path.duration_s()));
  i.pull = nullptr;
  i.simulated.machine().plant().set_pull(PlanarVector::Zero());
  return made;
}

MachineRecording MachineRun::rest(double duration_s) {
  MachineRecording made = impl_->start_recording();
  impl_->led.stand(kStill);
  impl_->record(made, impl_->samples_in(duration_s));
  return made;
}

void MachineRun::hang(double mass_kg) {
  impl_->simulated.machine().plant().hang(mass_kg);
  impl_->led.pause(kLoadComes);
  impl_->led.stand(kStill);
}

MachineRecording MachineRun::stops(const std::vector<JointVector>& poses_rad, double duration_s) {
  MachineRecording made = impl_->start_recording();
  for (const JointVector& pose : poses_rad) {
    impl_->led.go_to(pose);
    impl_->led.stand(kStill);
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
    impl_->led.go_to(pose);
    impl_->led.stand(kStill);
    const Points points = impl_->points();
    survey.poses.push_back({impl_->reading_m(), seen(points.arm_pin_m), seen(points.bucket_pin_m), seen(points.tip_m)});
  }
  return survey;
}

}  // namespace knuckle::motion
