#include "app/motion/led_machine.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "app/motion/path_builder.h"
#include "core/loop_table.h"
#include "machine/reason_text.h"

namespace knuckle::motion {
namespace {

constexpr Duration kSendPeriod = 2ms;
// A step of a 0.1 mm encoder turns the bucket by some milliradians where its lever is short, and noise makes it flicker
// between two: angles are smoothed over 20 messages (0.1 s) before they are compared.
constexpr double kRest_rad = 4e-3, kSmoothing = 0.05;

/// Slope of the samples at index i, by central differences; one-sided at the ends.
JointVector slope(const std::vector<JointVector>& samples, std::size_t i, double step_s) noexcept {
  const std::size_t before = i > 0 ? i - 1 : i, after = std::min(i + 1, samples.size() - 1);
  if (after == before) return JointVector::Zero();
  return (samples[after] - samples[before]) / (step_s * static_cast<double>(after - before));
}

}  // namespace

PathPoint point_at(const estimation::JointPath& path, double t_s) noexcept {
  const auto& samples = path.joint_rad;
  const double last = static_cast<double>(samples.size() - 1);
  const double place = t_s / path.step_s;
  if (place >= last) return {samples.back(), JointVector::Zero()};
  const double whole = std::max(0.0, std::floor(place));
  const auto i = static_cast<std::size_t>(whole);
  const double u = std::max(0.0, place - whole);
  const JointVector m0 = path.step_s * slope(samples, i, path.step_s);
  const JointVector m1 = path.step_s * slope(samples, i + 1, path.step_s);
  const JointVector rise = samples[i + 1] - samples[i];
  // Hermite: p(u) = p0 + m0 u + (3 d - 2 m0 - m1) u^2 + (m0 + m1 - 2 d) u^3
  const JointVector square = 3 * rise - 2 * m0 - m1, cube = m0 + m1 - 2 * rise;
  return {samples[i] + u * (m0 + u * (square + u * cube)), (m0 + u * (2 * square + u * 3 * cube)) / path.step_s};
}

void PathLeader::follow(const estimation::JointPath& path) {
  path_ = path;
  started_at_ = kNever;
  sent_.clutch = false;
}

void PathLeader::stand() noexcept {
  path_.joint_rad.clear();
  sent_.clutch = true;
}

void PathLeader::step(Time now) noexcept {
  hear(now);
  lead(now);
  if (now - sent_at_ >= kSendPeriod) send(now);
}

void PathLeader::hear(Time now) noexcept {
  Datagram datagram;
  while (link_.receive(datagram)) {
    auto message = decode_slave(datagram.view());
    if (!message) continue;
    const LinkSession::Verdict verdict = session_.take(message->stamp, now);
    if (verdict != LinkSession::Verdict::kNews && verdict != LinkSession::Verdict::kBegins) continue;
    const bool first = !machine_;
    machine_ = *message;
    smooth_rad_ += (first ? 1 : kSmoothing) * (machine_->position_rad - smooth_rad_);
  }
  if (!machine_) return;
  if (rest_since_ == kNever || (smooth_rad_ - rest_rad_).cwiseAbs().maxCoeff() > kRest_rad) {
    rest_rad_ = smooth_rad_;
    rest_since_ = now;
  }
}

void PathLeader::lead(Time now) noexcept {
  if (!machine_) return;
  // Enable counts only when pressed once the machine asks for it; a fault is never cleared from here.
  if (machine_->mode == Mode::kReady && !led_) {
    if (machine_->blocking.code == ReasonCode::kEnableNotPressed) sent_.enable = true;
    // One that is ready at once had not seen it released.
    if (machine_->blocking.code == ReasonCode::kEnableHeld) sent_.enable = false;
  }
  if (!engaged() || sent_.clutch) {
    sent_.position_rad = machine_->position_rad;
    sent_.velocity_radps.setZero();
    return;
  }
  led_ = true;
  if (path_.joint_rad.empty()) return;
  if (started_at_ == kNever) started_at_ = now;
  const PathPoint point = point_at(path_, to_seconds(now - started_at_));
  sent_.position_rad = point.joint_rad;
  sent_.velocity_radps = point.joint_radps;
}

void PathLeader::send(Time now) noexcept {
  sent_at_ = now;
  sent_.stamp = session_.stamp(sent_.stamp.sequence + 1, now);
  sent_.device_report_at = session_.to_link(now);
  sent_.presence = sent_.device_ok = true;
  link_.send(encode(sent_).view());
}

bool PathLeader::done(Time now) const noexcept {
  return path_.joint_rad.empty() || (started_at_ != kNever && to_seconds(now - started_at_) >= path_.duration_s());
}

bool PathLeader::at_rest(Time now, Duration time) const noexcept {
  return rest_since_ != kNever && now - rest_since_ >= time;
}

Reason PathLeader::trouble() const noexcept {
  if (!machine_) return {ReasonCode::kStartingUp, 0, 0, 0};
  if (engaged()) return {};
  // A hold as requested, or on the way out of it. One that comes on the way along a path stays until enable is
  // released.
  if (led_ && machine_->mode == Mode::kHold && (sent_.clutch || started_at_ == kNever)) return {};
  return machine_->fault ? machine_->fault : machine_->blocking;
}

namespace {

constexpr Duration kComeUp = 15s, kRestart = 3s, kRest = 20s;  // patience
constexpr Duration kBeforeMoving = 500ms, kRelease = 300ms;

}  // namespace

LedMachine::LedMachine(const MachineDescription& machine, BusAccess& access, Time first_step)
    : machine_(machine),
      kinematics_(machine),
      access_(access),
      period_(from_seconds(1 / machine.bus.sync_Hz)),
      step_due_(first_step),
      link_({}, {}, 1),
      leader_(link_.a(), start_from(0, LinkEnd::kOperator)),
      slave_(machine, access.bus(), link_.b(), start_from(0, LinkEnd::kMachine)) {}

/// A period that was missed is skipped.
bool LedMachine::advance() {
  access_.wait_until(access_.now() + kTick);
  const Time now = access_.now();
  link_.advance(now);
  leader_.step(now);
  if (now < step_due_) return false;
  step_due_ = std::max(step_due_ + period_, now);
  slave_.step(now);
  if (const auto& failure = slave_.client().setup_failure(); failure.what != slave::SetupFailure::What::kNone)
    setup_failure_ = failure;
  return true;
}

bool LedMachine::tick() {
  const bool stepped = advance();
  if (stepped) each_step();
  if (leader_.dropped_out())
    throw NotLed("the machine is no longer engaged: " + text(leader_.trouble(), slave_.client().bus()));
  return stepped;
}

bool LedMachine::run_until(const std::function<bool()>& reached, Duration patience) {
  for (const Time end = access_.now() + patience; !reached(); tick()) {
    if (access_.now() >= end) return false;
  }
  return true;
}

void LedMachine::require(bool reached, const char* otherwise) const {
  if (reached) return;
  const BusDescription& bus = slave_.client().bus();
  std::string why = text(setup_failure_, bus);
  if (const Reason trouble = leader_.trouble(); why.empty() && trouble) why = text(trouble, bus);
  throw NotLed(otherwise + (why.empty() ? why : ": " + why));
}

void LedMachine::engage() {
  require(run_until([this] { return leader_.engaged(); }, kComeUp), "the machine did not engage within 15 s");
  setup_failure_ = {};
}

void LedMachine::rest(Duration still) {
  require(rests(still, kRest), "the machine did not come to rest within 20 s");
}

void LedMachine::settle(Duration still, Duration patience) {
  (void)rests(still, patience);
}

bool LedMachine::rests(Duration still, Duration patience) {
  return run_until([&] { return leader_.at_rest(access_.now(), still); }, patience);
}

void LedMachine::stand(Duration still) {
  leader_.stand();
  rest(still);
}

void LedMachine::pause(Duration time) {
  leader_.stand();
  (void)run_until([] { return false; }, time);
}

void LedMachine::go_to(const JointVector& pose_rad) {
  stand(kBeforeMoving);
  lead(transfer(machine_, kinematics_, leader_.machine()->position_rad, pose_rad, to_seconds(period_)));
  require(run_until([this] { return leader_.engaged(); }, kRestart), "the machine did not engage again within 3 s");
  (void)run_until([this] { return done(); }, Duration::max() / 4);
}

bool LedMachine::record(estimation::Recording& into) {
  const JointVector demand = slave_.client().demand();  // on the wire while these sensors were sampled
  const auto measured = tick() ? slave_.sensors().measurement() : std::nullopt;
  if (!measured) return false;
  into.samples.push_back(*measured);
  into.samples.back().cylinder_m += machine_.sensors.encoder_offset_m;  // as the encoder reports it
  into.usable.push_back(1);
  into.valve.push_back(demand);
  return true;
}

void LedMachine::neutral() noexcept {
  leader_.stand();
  for (const Time end = access_.now() + kRelease; access_.now() < end;) advance();
}

}  // namespace knuckle::motion
