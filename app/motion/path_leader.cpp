#include "app/motion/path_leader.h"

#include <algorithm>
#include <cmath>

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
  if (machine_->mode == Mode::kReady && machine_->blocking.code == ReasonCode::kEnableNotPressed && !led_) {
    sent_.enable = true;
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

}  // namespace knuckle::motion
