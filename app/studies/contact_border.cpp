#include "app/studies/contact_border.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace knuckle::studies {
namespace {

constexpr double kSoftest_N_per_m = 8e3, kStiffest_N_per_m = 3e6, kClose = 1.03;
constexpr double kEarly_s[2] = {1, 2.5}, kLate_s[2] = {4.5, 6};  // after the step
constexpr double kCalmOfStep = 0.5, kCalmOfEarly = 0.6;
constexpr double kFineStep_m = 1e-6, kLittleNoise = 0.3;

using Samples = std::span<const ContactSample>;
using Component = double ContactSample::*;
using Control = MachineDescription::Control;

Samples between(const ContactRecord& record, const double (&span_s)[2]) {
  const auto at = [&](double t_s) {
    return std::min(record.samples.size(), record.stepped + static_cast<std::size_t>(std::lround(1e3 * t_s)));
  };
  return Samples(record.samples).subspan(at(span_s[0]), at(span_s[1]) - at(span_s[0]));
}

/// 2 sqrt(2) times the standard deviation about a straight line.
double swing_N(Samples samples, Component component) {
  const auto n = static_cast<double>(samples.size());
  double t1 = 0, f1 = 0, tt = 0, tf = 0, ff = 0;
  for (const ContactSample& sample : samples) {
    const double t = sample.t_s - samples.front().t_s, f = sample.*component;
    t1 += t, f1 += f, tt += t * t, tf += t * f, ff += f * f;
  }
  const double var_t = tt - t1 * t1 / n, var_f = ff - f1 * f1 / n, covariance = tf - t1 * f1 / n;
  return 2 * std::sqrt(2 * std::max(0.0, var_f - covariance * covariance / var_t) / n);
}

double frequency_Hz(Samples samples, Component component) {
  double mean = 0;
  for (const ContactSample& sample : samples) mean += sample.*component / static_cast<double>(samples.size());
  int upwards = 0;
  double first_s = 0, last_s = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (!(samples[i - 1].*component < mean && samples[i].*component >= mean)) continue;
    if (upwards++ == 0) first_s = samples[i].t_s;
    last_s = samples[i].t_s;
  }
  return upwards > 1 ? (upwards - 1) / (last_s - first_s) : 0;
}

/// Lasting contact losses before the step: 50 ms, shorter ones are the wall's own restitution.
int bounces(const ContactRecord& record) {
  constexpr int kLasting_ms = 50;
  int count = 0, off_ms = 0;
  bool touched = false;
  for (std::size_t i = 0; i < std::min(record.stepped, record.samples.size()); ++i) {
    const bool touches = record.samples[i].push_N > 0;
    if (touches && touched && off_ms >= kLasting_ms) ++count;
    off_ms = touches ? 0 : off_ms + 1;
    touched |= touches;
  }
  return count;
}

/// Of one key of the law, between an end at which the hold is taken for calm and one at which it may not be.
MeasuredBorder bisect(ContactTrial trial, double Control::*key, double calm, double swinging) {
  const auto swing_at = [&](double value) {
    trial.machine.control.*key = value;
    return judge_hold(trial, run_contact(trial));
  };
  const HoldSwing last = swing_at(swinging);
  if (last.calm) return {.calm = last};
  MeasuredBorder border{.found = true, .frequency_Hz = last.frequency_Hz, .calm = {}};
  while (std::max(swinging / calm, calm / swinging) > kClose) {
    const double middle = std::sqrt(calm * swinging);
    const HoldSwing swing = swing_at(middle);
    (swing.calm ? calm : swinging) = middle;
    if (swing.calm) border.calm = swing;
    if (!swing.calm) border.frequency_Hz = swing.frequency_Hz;
  }
  border.value = std::sqrt(calm * swinging);
  return border;
}

}  // namespace

MachineDescription with_valves(const MachineDescription& machine, Valves valves) {
  MachineDescription changed = machine;
  if (valves == Valves::kAsOnFile) return changed;
  for (CylinderDescription& cylinder : changed.cylinders) {
    cylinder.valve.dead_band_extend = cylinder.valve.dead_band_retract = cylinder.valve.hysteresis = 0;
  }
  changed.control.dither = changed.control.learning_limit = 0;
  changed.sensors.encoder_step_m = kFineStep_m;
  // Not none: a transmitter that repeats itself for long counts as frozen.
  changed.sensors.pressure_noise_Pa *= kLittleNoise;
  changed.sensors.tilt_noise_rad = 0;
  return changed;
}

HoldSwing judge_hold(const ContactTrial& trial, const ContactRecord& record) {
  HoldSwing found;
  found.hold.normal = trial.pose.normal;
  found.hold.place_m = trial.pose.place_m;
  found.hold.wall_N_per_m = trial.wall_N_per_m;
  found.hold.wall_damping_ratio = trial.wall_damping_ratio;
  found.trouble = record.trouble;
  const Samples early = between(record, kEarly_s), late = between(record, kLate_s);
  if (!record.trouble.empty() || early.empty() || late.empty()) return found;
  const auto worse = [](Samples samples) {
    return std::max(swing_N(samples, &ContactSample::push_N), swing_N(samples, &ContactSample::along_N));
  };
  found.early_N = worse(early);
  found.late_N = worse(late);
  const bool slides = swing_N(late, &ContactSample::along_N) > swing_N(late, &ContactSample::push_N);
  found.frequency_Hz = frequency_Hz(late, slides ? &ContactSample::along_N : &ContactSample::push_N);
  found.calm = found.late_N < std::max(kCalmOfStep * trial.step_N, kCalmOfEarly * found.early_N);
  found.bounces = bounces(record);
  for (std::size_t i = 0; i < record.stepped; ++i) found.peak_N = std::max(found.peak_N, record.samples[i].push_N);
  const PlanarVector along(-trial.pose.normal.y(), trial.pose.normal.x());
  for (const ContactSample& sample : late) {
    const double share = 1 / static_cast<double>(late.size());
    found.hold.joint_rad += share * sample.joint_rad;
    found.hold.force_N += share * (sample.push_N * trial.pose.normal + sample.along_N * along);
    for (std::size_t i = 0; i < 6; ++i) found.hold.chamber_Pa[i] += share * sample.chamber_Pa[i];
  }
  return found;
}

MeasuredBorder measure_stiffness_border(ContactTrial trial) {
  trial.machine.control.contact_crossover_radps = kNoBound_radps;
  return bisect(std::move(trial), &Control::tip_stiffness_N_per_m, kStiffest_N_per_m, kSoftest_N_per_m);
}

MeasuredBorder measure_crossover_border(ContactTrial trial) {
  return bisect(std::move(trial), &Control::contact_crossover_radps, kSlowest_radps, kFastest_radps);
}

}  // namespace knuckle::studies
