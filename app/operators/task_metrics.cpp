#include "app/operators/task_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <optional>
#include <span>
#include <unsupported/Eigen/FFT>

#include "core/error.h"
#include "machine/kinematics.h"
#include "master/device_kinematics.h"
#include "master/master_state.h"
#include "recording/recording.h"
#include "recording/replay.h"
#include "recording/wire_events.h"
#include "slave/slave_state.h"

namespace knuckle::operators {

namespace {

using recording::Topic;

/// The file, and where it is called ..._part001.mcap, those that follow it.
std::vector<std::string> parts_of(const std::string& file) {
  constexpr std::string_view kFirst = "_part001.mcap";
  std::vector<std::string> parts{file};
  if (!file.ends_with(kFirst)) return parts;
  const std::string stem = file.substr(0, file.size() - kFirst.size());
  std::error_code ignored;
  for (int part = 2;; ++part) {
    const std::string next = fmt::format("{}_part{:03}.mcap", stem, part);
    if (!std::filesystem::is_regular_file(next, ignored)) return parts;
    parts.push_back(next);
  }
}

/// @throws InputError unless a person worked in it, from its beginning on.
recording::ReplaySetup task_setup(const recording::Recording& recording) {
  const recording::Head& head = recording.head();
  if (head.imported)
    throw InputError(
        recording.source() +
        ": was imported from a table: it has no modes, no forces and no operator's side to measure a task by");
  if (!head.has_operator && !head.has_machine)
    throw InputError(recording.source() + ": is of " + head.program + ": it has no loop's states");
  if (head.part != 1)
    throw InputError(recording.source() +
                     ": begins in the middle of a session (a flight record, or a later part): name part 1");
  return setup_of(recording);
}

class TaskReader {
 public:
  explicit TaskReader(const std::string& file)
      : recording_(parts_of(file)),
        setup_(task_setup(recording_)),
        machine_(setup_.machine),
        hand_(setup_.device.link_m) {
    task_.source = file;
  }

  TaskRecording read() {
    while (const auto entry = recording_.next()) take(*entry);
    task_.flaws = defects(recording_);
    task_.notes = recording_.order_notes();
    return std::move(task_);
  }

 private:
  void take(const recording::Entry& entry) {
    const recording::Head& head = recording_.head();
    if (entry.topic == Topic::kMachineState && head.has_machine)
      take(entry.at, recording::state_in<slave::SlaveState>(entry, recording_));
    if (entry.topic == Topic::kOperatorState && head.has_operator)
      take(entry.at, recording::state_in<master::MasterState>(entry, recording_));
    if (entry.topic == Topic::kOperatorWires && !head.has_machine) take_told(entry);
    if (entry.topic != Topic::kEvents) return;
    auto event = recording::decode_log(entry.data, head.started_unix_ns);
    if (event && event->kind == "bookmark") task_.bookmarks.push_back(std::move(*event));
  }

  void take(Time at, const slave::SlaveState& state) {
    if (!state.measured) return;
    add({at, state.mode, state.fault.code, state.clutch, state.contact, state.confidence, state.tip_force_N.norm()},
        state.joint_rad, state.joint_radps);
  }
  void take(Time at, const master::MasterState& state) {
    clutch_ = state.clutch;
    if (state.reports == 0) return;
    const master::DevicePosture posture = hand_.posture(state.device_rad);
    task_.hand.push_back({at, posture.tip_m, posture.jacobian * state.device_radps});
  }
  /// The machine's newest message of a step.
  void take_told(const recording::Entry& entry) {
    const auto wires = recording::decode_wires(entry.data, recording_.head().link_version);
    if (!wires) return;
    for (const recording::WireEvent& event : wires->events) {
      if (event.kind != recording::WireEventKind::kLinkReceived) continue;
      const auto told = decode_slave(event.data);
      if (!told) continue;
      const bool same = newest_ && newest_->session == told->stamp.session;
      if (same && !newer(told->stamp.sequence, newest_->sequence)) continue;
      newest_ = told->stamp;
      add({entry.at, told->mode, told->fault.code, clutch_, told->contact, told->confidence, told->tip_force_N.norm()},
          told->position_rad, told->velocity_radps);
    }
  }
  void add(MachineSample sample, const JointVector& joint_rad, const JointVector& joint_radps) {
    sample.tip_m = machine_.tip(joint_rad);
    sample.tip_mps = machine_.tip_jacobian(joint_rad) * joint_radps;
    task_.machine.push_back(sample);
  }

  recording::Recording recording_;
  recording::ReplaySetup setup_;
  Kinematics machine_;
  master::DeviceKinematics hand_;
  TaskRecording task_;
  std::optional<LinkStamp> newest_;
  bool clutch_ = false;
};

}  // namespace

TaskRecording read_task(const std::string& file) {
  return TaskReader(file).read();
}

namespace {

constexpr double kHighest_Hz = 10;
constexpr double kLeastPart = 0.05;
constexpr std::size_t kPadding = 16;

}  // namespace

std::optional<double> spectral_arc_length(const std::vector<double>& speed, double step_s) {
  if (speed.size() < 4) return std::nullopt;
  std::vector<double> padded = speed;
  padded.resize(kPadding * std::bit_ceil(speed.size()), 0.0);
  std::vector<std::complex<double>> spectrum;
  Eigen::FFT<double>().fwd(spectrum, padded);
  const double whole = std::abs(spectrum.front());
  if (!(whole > 0)) return std::nullopt;
  const double bin_Hz = 1 / (step_s * static_cast<double>(padded.size()));
  const auto bins = std::min(padded.size() / 2, static_cast<std::size_t>(kHighest_Hz / bin_Hz) + 1);
  std::size_t last = 0;
  for (std::size_t i = 0; i < bins; ++i) {
    if (std::abs(spectrum[i]) >= kLeastPart * whole) last = i;
  }
  double length = 0;
  for (std::size_t i = 1; i <= last; ++i)
    length += std::hypot(1 / static_cast<double>(last), (std::abs(spectrum[i]) - std::abs(spectrum[i - 1])) / whole);
  return -length;
}

int velocity_peaks(const std::vector<double>& speed, double least) noexcept {
  int peaks = 0;
  bool rising = true;
  double low = 0, high = 0;
  for (const double now : speed) {
    high = std::max(high, now);
    low = std::min(low, now);
    if (rising && high - low >= least && high - now >= least) {
      ++peaks;
      rising = false;
      low = now;
    } else if (!rising && now - low >= least) {
      rising = true;
      high = now;
    }
  }
  return peaks;
}

namespace {

constexpr const char* kTaskStart = "task start";
constexpr const char* kTaskEnd = "task end";
constexpr double kBelieved = 0.5;  // confidence
constexpr double kIdle_mps = 0.01;
constexpr double kTipStep_m = 5e-3;   // path: smaller steps are noise
constexpr double kHandStep_m = 5e-4;  // likewise; a tenth, as the hand's way is to the machine's
constexpr double kTipPeak_mps = 0.02;
constexpr double kHandPeak_mps = 2e-3;
constexpr Duration kUniform = 5ms;
constexpr std::size_t kSmoothReach = 10;  // samples before and after: 0.1 s in all
constexpr Duration kLongestStep = 50ms;   // a sample counts for no longer: then steps are missing
constexpr Duration kContactGap = 200ms;   // a contact goes on after less than this
constexpr Duration kImpact = 500ms, kAfterImpact = 1s;

struct Window {
  Time from{}, to{};
  [[nodiscard]] bool has(Time at) const noexcept { return at >= from && at <= to; }
  [[nodiscard]] double length_s() const noexcept { return to_seconds(to - from); }
};

std::optional<Window> engaged_window(const TaskRecording& task) {
  std::optional<Window> window;
  for (const MachineSample& sample : task.machine) {
    if (sample.mode != Mode::kEngaged) continue;
    window = Window{window ? window->from : sample.at, sample.at};
  }
  return window;
}

std::optional<Window> bookmarked_window(const TaskRecording& task) {
  std::optional<Time> start, end;
  bool other_end = false;
  for (const recording::Event& bookmark : task.bookmarks) {
    if (bookmark.text == kTaskStart && !start) start = bookmark.at;
    if (bookmark.text != kTaskEnd) continue;
    if (start && !end && bookmark.at > *start) end = bookmark.at;
    other_end = true;
  }
  if (!start && !other_end) return std::nullopt;
  if ((!start || !end) && !task.flaws.empty()) return std::nullopt;  // the other one is in what is missing
  if (!start || !end)
    throw InputError(task.source + ": bookmark \"" + (start ? kTaskStart : kTaskEnd) + "\": has no \"" +
                     (start ? kTaskEnd : kTaskStart) + (start ? "\" after it" : "\" before it"));
  return Window{*start, *end};
}

template <typename Sample>
std::span<const Sample> within(const std::vector<Sample>& samples, const Window& window) {
  const auto before = [](const Sample& sample, Time at) { return sample.at < at; };
  const auto after = [](Time at, const Sample& sample) { return at < sample.at; };
  return {std::lower_bound(samples.begin(), samples.end(), window.from, before),
          std::upper_bound(samples.begin(), samples.end(), window.to, after)};
}

/// Time for which samples hold that are as asked; each until the next.
template <typename Ask>
double time_s(std::span<const MachineSample> samples, const Ask& ask) {
  Duration sum{};
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    if (ask(samples[i])) sum += std::min(samples[i + 1].at - samples[i].at, kLongestStep);
  }
  return to_seconds(sum);
}

/// How often a sample is as asked and the one before is not.
template <typename Ask>
double beginnings(std::span<const MachineSample> samples, const Ask& ask) {
  int count = 0;
  bool before = false;
  for (const MachineSample& sample : samples) {
    const bool now = ask(sample);
    if (now && !before) ++count;
    before = now;
  }
  return count;
}

std::vector<Window> contacts_in(std::span<const MachineSample> samples) {
  std::vector<Window> contacts;
  for (const MachineSample& sample : samples) {
    if (!sample.contact) continue;
    if (contacts.empty() || sample.at - contacts.back().to > kContactGap) {
      contacts.push_back({sample.at, sample.at});
    } else {
      contacts.back().to = sample.at;
    }
  }
  return contacts;
}

bool felt_and_known(const MachineSample& sample) {
  return sample.contact && sample.confidence > kBelieved;
}

struct Force {
  Metric peak_N, mean_N;
};
/// Of what is known, in contact.
Force force_in(std::span<const MachineSample> samples, Time from, Time to) {
  Force force;
  double sum = 0;
  int count = 0;
  for (const MachineSample& sample : samples) {
    if (sample.at < from || sample.at > to || !felt_and_known(sample)) continue;
    force.peak_N = std::max(force.peak_N.value_or(0), sample.tip_force_N);
    sum += sample.tip_force_N;
    ++count;
  }
  if (count > 0) force.mean_N = sum / count;
  return force;
}

Metric overshoot(std::span<const MachineSample> samples, const std::vector<Window>& contacts) {
  double sum = 0;
  int count = 0;
  for (const Window& contact : contacts) {
    const Time settled = contact.from + kImpact, end = settled + kAfterImpact;
    if (contact.to < end) continue;
    const Metric peak_N = force_in(samples, contact.from, settled).peak_N;
    const Metric mean_N = force_in(samples, settled, end).mean_N;
    if (!peak_N || !mean_N || *mean_N <= 0) continue;
    sum += *peak_N / *mean_N;
    ++count;
  }
  return count > 0 ? Metric(sum / count) : std::nullopt;
}

/// Length of the way in steps of `step_m`: what moves less, and back, is noise.
template <typename Sample>
Metric path_m(std::span<const Sample> samples, PlanarVector Sample::*place, double step_m) {
  if (samples.empty()) return std::nullopt;
  double length_m = 0;
  PlanarVector from = samples.front().*place;
  for (const Sample& sample : samples) {
    const double way_m = (sample.*place - from).norm();
    if (way_m < step_m) continue;
    length_m += way_m;
    from = sample.*place;
  }
  return length_m + (samples.back().*place - from).norm();
}

/// Size of a velocity, every kUniform, linear in between; the velocity's mean over kSmooth, as the size of its noise
/// would be taken for speed.
template <typename Sample>
std::vector<double> speeds(std::span<const Sample> samples, PlanarVector Sample::*velocity) {
  if (samples.size() < 2) return {};
  std::vector<PlanarVector> even;
  std::size_t next = 1;
  for (Time at = samples.front().at; at <= samples.back().at; at += kUniform) {
    while (next + 1 < samples.size() && samples[next].at < at) ++next;
    const Sample &a = samples[next - 1], &b = samples[next];
    const double span_s = to_seconds(b.at - a.at);
    const double share = span_s > 0 ? to_seconds(at - a.at) / span_s : 1;
    even.push_back(a.*velocity + share * (b.*velocity - a.*velocity));
  }
  std::vector<double> speed;
  for (std::size_t i = 0; i < even.size(); ++i) {
    const std::size_t first = i - std::min(i, kSmoothReach), end = std::min(i + kSmoothReach + 1, even.size());
    PlanarVector sum = PlanarVector::Zero();
    for (std::size_t k = first; k < end; ++k) sum += even[k];
    speed.push_back(sum.norm() / static_cast<double>(end - first));
  }
  return speed;
}

void measure_contact(std::span<const MachineSample> samples, TaskMetrics& metrics) {
  const std::vector<Window> contacts = contacts_in(samples);
  metrics.contacts = static_cast<double>(contacts.size());
  metrics.contact_time_s = time_s(samples, [](const MachineSample& s) { return s.contact; });
  if (contacts.empty()) return;
  const Force force = force_in(samples, samples.front().at, samples.back().at);
  metrics.peak_contact_force_N = force.peak_N;
  metrics.mean_contact_force_N = force.mean_N;
  metrics.contact_overshoot = overshoot(samples, contacts);
}

void measure_counts(std::span<const MachineSample> samples, TaskMetrics& metrics) {
  const auto stop = [](const MachineSample& s) {
    return s.mode == Mode::kEStop || (s.mode == Mode::kFault && s.fault == ReasonCode::kOperatorStop);
  };
  metrics.engagements = beginnings(samples, [](const MachineSample& s) { return s.mode == Mode::kEngaged; });
  metrics.clutches = beginnings(samples, [](const MachineSample& s) { return s.clutch; });
  metrics.stops = beginnings(samples, stop);
  metrics.faults = beginnings(samples, [&](const MachineSample& s) { return s.mode == Mode::kFault && !stop(s); });
}

/// @param speed_mps of the tip, every kUniform from the first sample on.
double idle_s(std::span<const MachineSample> samples, const std::vector<double>& speed_mps) {
  if (speed_mps.empty()) return 0;
  return time_s(samples, [&](const MachineSample& sample) {
    const auto at = static_cast<std::size_t>((sample.at - samples.front().at) / kUniform);
    return speed_mps[std::min(at, speed_mps.size() - 1)] < kIdle_mps && !sample.contact;
  });
}

void measure_machine(std::span<const MachineSample> samples, TaskMetrics& metrics) {
  const double engaged_s = time_s(samples, [](const MachineSample& s) { return s.mode == Mode::kEngaged; });
  metrics.engaged_time_s = engaged_s;
  const double unknown_s =
      time_s(samples, [](const MachineSample& s) { return s.mode == Mode::kEngaged && s.confidence <= kBelieved; });
  if (engaged_s > 0) metrics.force_unknown_share = unknown_s / engaged_s;
  measure_counts(samples, metrics);
  measure_contact(samples, metrics);
  metrics.tip_path_m = path_m(samples, &MachineSample::tip_m, kTipStep_m);
  const std::vector<double> speed_mps = speeds(samples, &MachineSample::tip_mps);
  metrics.idle_time_s = idle_s(samples, speed_mps);
  metrics.tip_smoothness = spectral_arc_length(speed_mps, to_seconds(kUniform));
  metrics.tip_velocity_peaks = velocity_peaks(speed_mps, kTipPeak_mps);
}

}  // namespace

TaskMetrics measure(const TaskRecording& task) {
  TaskMetrics metrics;
  const std::optional<Window> engaged = engaged_window(task), bookmarked = bookmarked_window(task);
  if (engaged) metrics.task_time_s = engaged->length_s();
  if (bookmarked) metrics.bookmarked_time_s = bookmarked->length_s();
  const std::optional<Window> window = bookmarked ? bookmarked : engaged;
  if (!window) return metrics;
  if (const auto machine = within(task.machine, *window); !machine.empty()) measure_machine(machine, metrics);
  const auto hand = within(task.hand, *window);
  metrics.hand_path_m = path_m(hand, &HandSample::hand_m, kHandStep_m);
  if (hand.empty()) return metrics;
  const std::vector<double> speed_mps = speeds(hand, &HandSample::hand_mps);
  metrics.hand_smoothness = spectral_arc_length(speed_mps, to_seconds(kUniform));
  metrics.hand_velocity_peaks = velocity_peaks(speed_mps, kHandPeak_mps);
  return metrics;
}

}  // namespace knuckle::operators
