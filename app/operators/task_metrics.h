// Metrics of a person's task.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "recording/events.h"
#include "transport/link_messages.h"

namespace knuckle::operators {

// What of a recording the metrics of a task are made of: the same whichever side recorded it.
/// The machine at one time, as its own loop knew it, or as the operator's side was told.
struct MachineSample {
  Time at{};
  Mode mode = Mode::kOff;
  ReasonCode fault = ReasonCode::kNone;
  bool clutch = false;
  bool contact = false;
  double confidence = 0;                        ///< In the force, [0, 1].
  double tip_force_N = 0;                       ///< Its size, without the load's.
  PlanarVector tip_m = PlanarVector::Zero();    ///< Frame M.
  PlanarVector tip_mps = PlanarVector::Zero();  ///< As noisy as the encoders make it.
};

/// The hand at one time, frame D.
struct HandSample {
  Time at{};
  PlanarVector hand_m = PlanarVector::Zero();
  PlanarVector hand_mps = PlanarVector::Zero();
};

struct TaskRecording {
  std::string source;
  std::vector<MachineSample> machine;
  std::vector<HandSample> hand;  ///< Empty where the operator's side was not recorded.
  std::vector<recording::Event> bookmarks;
  std::vector<std::string> flaws;  ///< Why it is not all of the trial, a line each; empty: it is whole.
  std::vector<std::string> notes;  ///< What is unusual in its order, likewise.
};

/// @param file a recording; of one in parts, the first, which those beside it follow.
/// @throws InputError where it cannot be opened, holds no loop's states (an imported table, a bus by itself), begins in
/// the middle of a session, or has states that this version does not know.
[[nodiscard]] TaskRecording read_task(const std::string& file);

/// Spectral arc length, dimensionless and negative; the nearer to zero, the smoother. Neither the motion's size nor its
/// duration changes it, its halts and corrections do.
///   SPARC = -integral from 0 to w_c of sqrt((1 / w_c)^2 + (dV/dw)^2) dw,   V(w) = |F(w)| / F(0),
/// F the Fourier transform of the speed; w_c the highest frequency up to 10 Hz at which V is 0.05 or more.
/// Balasubramanian, Melendez-Calderon, Roby-Brami, Burdet: "On the analysis of movement smoothness", Journal of
/// NeuroEngineering and Rehabilitation 12:112, 2015. The spectrum is sampled as there: padded with zeros to 16 times
/// the next power of two.
/// @param speed equally spaced by step_s, from rest to rest. @return nullopt where nothing moves, or where there are
/// fewer than four samples.
[[nodiscard]] std::optional<double> spectral_arc_length(const std::vector<double>& speed, double step_s);

/// Maxima from which the speed falls, and to which it rises, by at least `least`: a motion in one go has one.
[[nodiscard]] int velocity_peaks(const std::vector<double>& speed, double least) noexcept;

using Metric = std::optional<double>;

/// Over the task: from the bookmark "task start" to the next "task end", else from the first engaged to the last. What
/// did not happen is none, not 0: the force of a contact where there was no contact.
struct TaskMetrics {
  Metric task_time_s;        ///< First engaged to last engaged, whatever bookmarks say.
  Metric bookmarked_time_s;  ///< Between the bookmarks.
  Metric engaged_time_s;
  Metric idle_time_s;  ///< Slower than 1 cm/s at the tip and not in contact.
  Metric engagements, clutches, stops, faults;
  Metric contacts;  ///< Interruptions of less than 0.2 s left out.
  Metric contact_time_s;
  Metric peak_contact_force_N, mean_contact_force_N;  ///< In contact, with a confidence of more than 0.5.
  /// Peak force of the first 0.5 s of a contact over its mean in the second after; mean of the contacts that last so
  /// long.
  Metric contact_overshoot;
  Metric force_unknown_share;  ///< Of the time engaged, with a confidence of 0.5 or less.
  Metric tip_path_m, hand_path_m;
  Metric tip_smoothness, hand_smoothness;  ///< Spectral arc length.
  Metric tip_velocity_peaks, hand_velocity_peaks;
};

struct MetricInfo {
  const char* name;
  const char* unit;
  Metric TaskMetrics::*value;
};
inline constexpr std::array<MetricInfo, 20> kMetrics{{
    {"task_time", "s", &TaskMetrics::task_time_s},
    {"bookmarked_time", "s", &TaskMetrics::bookmarked_time_s},
    {"engaged_time", "s", &TaskMetrics::engaged_time_s},
    {"idle_time", "s", &TaskMetrics::idle_time_s},
    {"engagements", "1", &TaskMetrics::engagements},
    {"clutches", "1", &TaskMetrics::clutches},
    {"stops", "1", &TaskMetrics::stops},
    {"faults", "1", &TaskMetrics::faults},
    {"contacts", "1", &TaskMetrics::contacts},
    {"contact_time", "s", &TaskMetrics::contact_time_s},
    {"peak_contact_force", "N", &TaskMetrics::peak_contact_force_N},
    {"mean_contact_force", "N", &TaskMetrics::mean_contact_force_N},
    {"contact_overshoot", "1", &TaskMetrics::contact_overshoot},
    {"force_unknown_share", "1", &TaskMetrics::force_unknown_share},
    {"tip_path", "m", &TaskMetrics::tip_path_m},
    {"hand_path", "m", &TaskMetrics::hand_path_m},
    {"tip_smoothness", "1", &TaskMetrics::tip_smoothness},
    {"hand_smoothness", "1", &TaskMetrics::hand_smoothness},
    {"tip_velocity_peaks", "1", &TaskMetrics::tip_velocity_peaks},
    {"hand_velocity_peaks", "1", &TaskMetrics::hand_velocity_peaks},
}};

/// @throws InputError where, in a whole recording, "task end" does not follow "task start", or one of the two is
/// missing.
[[nodiscard]] TaskMetrics measure(const TaskRecording& task);

}  // namespace knuckle::operators
