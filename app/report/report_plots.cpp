#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "app/report/plots.h"
#include "app/report/report.h"
#include "app/report/result_text.h"
#include "app/session/record_windows.h"

namespace knuckle::report {
namespace {

using Marks = std::vector<PlotMark>;

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr std::array<const char*, kJoints> kJointColours{kBlue, kVermilion, kGreen};
constexpr const char *kTimeline = "Session timeline", *kAngles = "Joint angles",
                     *kForces = "Contact force on the bucket tip", *kFelt = "Felt force",
                     *kEnergy = "Energy at hand and machine";

/// Panels of a session record: a curve is a signal evaluated at each sample.
using Signal = std::function<double(const session::Sample&)>;
class SessionPlot {
 public:
  SessionPlot(const session::SessionRecord& record, const Marks& marks)
      : record_(record), t_s_(values([](const session::Sample& s) { return s.t_s; })) {
    for (const session::EventRecord& event : record.events) plot_.mark(event.t_s);
    for (const PlotMark& mark : marks) plot_.mark(mark.t_s, mark.label);
  }

  void panel(const std::string& y_label) { plot_.panel(y_label); }
  void line(const Signal& signal, const std::string& title, const char* colour, const std::string& style = "lw 1.5") {
    plot_.line(t_s_, values(signal), title, colour, style);
  }
  void band(const Signal& low, const Signal& high, const std::string& title, const char* colour) {
    plot_.band(t_s_, values(low), values(high), title, colour);
  }
  [[nodiscard]] Figure figure() const { return plot_.figure(t_s_); }

 private:
  [[nodiscard]] std::vector<double> values(const Signal& signal) const {
    std::vector<double> y;
    for (const session::Sample& sample : record_.samples) y.push_back(signal(sample));
    return y;
  }

  const session::SessionRecord& record_;
  std::vector<double> t_s_;
  PanelPlot plot_;
};

PageFigure angles(const session::SessionRecord& record, const Marks& marks) {
  SessionPlot plot(record, marks);
  plot.panel("joint angle, deg");
  for (int j = 0; j < kJoints; ++j) {
    const auto at = static_cast<std::size_t>(j);
    plot.line([j](const session::Sample& s) { return s.machine.joint_rad[j] * kDegPerRad; }, kJointNames[at],
              kJointColours[at]);
  }
  for (int j = 0; j < kJoints; ++j)
    plot.line([j](const session::Sample& s) { return s.machine.setpoint_rad[j] * kDegPerRad; },
              j == 0 ? "set-point" : "", kInk, "dt 2 lw 0.9");
  return {kAngles, "Measured angles, and the operator's set-point as received by the machine.", plot.figure()};
}

/// Gaps where nobody measures it.
Signal pressure_bar(std::size_t chamber) {
  return [chamber](const session::Sample& s) {
    const bool known = s.machine.measured && (s.machine.unknown_torques >> chamber / 2 & 1) == 0;
    return known ? s.machine.pressure_Pa[chamber] * 1e-5 : std::nan("");
  };
}

PageFigure pressures(const session::SessionRecord& record, const Marks& marks) {
  SessionPlot plot(record, marks);
  std::string without;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto known = [bar = pressure_bar(2 * j)](const session::Sample& s) { return !std::isnan(bar(s)); };
    if (std::none_of(record.samples.begin(), record.samples.end(), known)) {
      without += std::string(without.empty() ? " Not measured: " : ", ") + kJointNames[j];
      continue;
    }
    plot.panel(std::string(kJointNames[j]) + ", bar");
    plot.line(pressure_bar(2 * j), "A, head side", kVermilion, "lw 1");
    plot.line(pressure_bar(2 * j + 1), "B, rod side", kGreen, "lw 1");
  }
  return {"Cylinder pressures",
          std::string("As measured by the pressure transmitters; a gap where they are not heard.") +
              (without.empty() ? "" : without + '.'),
          plot.figure()};
}

PageFigure valves(const session::SessionRecord& record, const Marks& marks) {
  SessionPlot plot(record, marks);
  for (int j = 0; j < kJoints; ++j) {
    plot.panel(std::string(kJointNames[static_cast<std::size_t>(j)]) + ", %");
    plot.line([j](const session::Sample& s) { return 100 * s.truth.spool[j]; }, "spool, true", kGrey, "lw 1");
    plot.line([j](const session::Sample& s) { return 100 * s.machine.valve_command[j]; }, "command", kBlue, "lw 1");
  }
  return {"Valve commands",
          "What the safety gate let pass, in per cent of the spool's stroke, and the simulator's spools. Positive "
          "extends the cylinder.",
          plot.figure()};
}

PageFigure forces(const session::SessionRecord& record, const Marks& marks) {
  const auto estimated = [](const session::Sample& s, double force_N) {
    return s.machine.measured ? 1e-3 * force_N : std::nan("");
  };
  SessionPlot plot(record, marks);
  for (const int axis : {0, 1}) {
    const std::size_t cov = axis == 0 ? 0 : 2;
    const auto edge = [=](double side) {
      return [=](const session::Sample& s) {
        return estimated(s, s.machine.tip_force_N[axis] +
                                side * kTwoSided95 * std::sqrt(std::max(0.0, s.machine.covariance_N2[cov])));
      };
    };
    plot.panel(axis == 0 ? "forward, kN" : "up, kN");
    plot.band(edge(-1), edge(1), "95 % band", kBlue);
    plot.line([axis](const session::Sample& s) { return 1e-3 * s.truth.tip_force_N[axis]; }, "true", kVermilion);
    plot.line([=](const session::Sample& s) { return estimated(s, s.machine.tip_force_N[axis]); }, "estimated", kBlue);
  }
  return {kForces,
          "Estimated from cylinder pressures with its 95 % band (a gap while sensors are not heard), compared with the "
          "simulator's true force.",
          plot.figure()};
}

/// What there is to feel: the load's weight, too.
Signal truth_at_hand(const session::SessionRecord& record) {
  return [scale = record.force_scale](const session::Sample& s) {
    return scale * (s.truth.tip_force_N + s.truth.weight_N).norm();
  };
}

PageFigure felt(const session::SessionRecord& record, const Marks& marks) {
  SessionPlot plot(record, marks);
  plot.panel("felt force, N");
  plot.line(truth_at_hand(record), "contact and load, true, scaled", kVermilion);
  plot.line([](const session::Sample& s) { return s.hand.felt_N.norm(); }, "felt by the hand", kBlue);
  return {kFelt,
          "Force on the operator's hand, compared with what there is to feel: true contact force and weight of the "
          "load, times the force scale.",
          plot.figure()};
}

/// Largest value of a curve, at least 1e-9: an axis needs a length.
double largest(const session::SessionRecord& record, const Signal& signal) {
  double most = 1e-9;
  for (const session::Sample& s : record.samples) most = std::max(most, signal(s));
  return most;
}

/// How the hand's force depends on the machine's: on the diagonal, the hand is told the truth.
PageFigure felt_against_true(const session::SessionRecord& record) {
  constexpr std::size_t kMostPoints = 2000;
  const Signal truth = truth_at_hand(record);
  const Signal felt = [](const session::Sample& s) { return s.hand.felt_N.norm(); };
  const double most = 1.05 * std::max(largest(record, truth), largest(record, felt));
  std::ostringstream s;
  s << "$felt << EOD\n";
  const std::size_t step = std::max<std::size_t>(1, record.samples.size() / kMostPoints);
  for (std::size_t i = 0; i < record.samples.size(); i += step) {
    if (record.samples[i].machine.mode != Mode::kEngaged) continue;
    s << truth(record.samples[i]) << ' ' << felt(record.samples[i]) << '\n';
  }
  s << "EOD\n$equal << EOD\n0 0\n"
    << most << ' ' << most << "\nEOD\n"
    << plot_style() << "set size ratio -1\nset xrange [0:" << most << "]\nset yrange [0:" << most
    << "]\nset xlabel 'contact and load, true, scaled to the hand, N'\nset ylabel 'felt force, N'\nplot $equal using "
       "1:2 with "
       "lines "
       "lw 1 dt 2 lc rgb '"
    << kInk << "' title 'felt = true', $felt using 1:2 with points pt 7 ps 0.35 lc rgb '" << kBlue
    << "' title 'while engaged'\n";
  return {"Felt against true force",
          "Magnitudes while engaged. Below the diagonal less is felt than the machine feels; far from it are onset and "
          "end of contact, which delay and filters smear.",
          {900, 420, s.str()}};
}

PageFigure energy(const session::SessionRecord& record, const Marks& marks) {
  SessionPlot plot(record, marks);
  plot.panel("hand, mJ");
  plot.line([](const session::Sample& s) { return 1e3 * s.hand.energy_J; }, "work of the device on the hand", kBlue);
  plot.panel("machine, kJ");
  plot.line([](const session::Sample& s) { return 1e-3 * s.truth.energy_to_machine_J; },
            "work of the valves on the machine", kOrange);
  return {kEnergy,
          "Cumulative work of the device on the hand and of the valves on the machine; where a curve falls, hand or "
          "machine does the work.",
          plot.figure()};
}

/// Rows of bars over time: what was on, and when.
class Timeline {
 public:
  explicit Timeline(const session::SessionRecord& record) : record_(record) {}

  /// One row of bars; `label` names the bar a sample belongs to, empty for none.
  void row(const std::string& name, const std::function<std::string(const session::Sample&)>& label,
           const char* colour) {
    names_ += (rows_ > 0 ? ", " : "") + plot_quoted(name) + " " + std::to_string(-rows_);
    const auto& samples = record_.samples;
    int bar = 0;
    for (std::size_t i = 0; i < samples.size();) {
      const std::string text = label(samples[i]);
      const std::size_t begin = i;
      while (i < samples.size() && label(samples[i]) == text) ++i;
      if (!text.empty()) add_bar(samples[begin].t_s, samples[i - 1].t_s, text == name ? "" : text, colour, bar++);
    }
    ++rows_;
  }

  void mark(const PlotMark& mark) { bars_ << plot_mark(mark.t_s, mark.label); }

  [[nodiscard]] Figure figure() const {
    const double first_s = record_.samples.empty() ? 0 : record_.samples.front().t_s;
    const double last_s = record_.samples.empty() ? 1 : record_.samples.back().t_s;
    std::ostringstream s;
    s << plot_style()
      << "unset key\nset border 1\nset lmargin at screen 0.085\nset rmargin at screen 0.985\nset xrange [" << first_s
      << ':' << std::max(last_s, first_s + 1e-3) << "]\nset yrange [" << 0.6 - rows_ << ":0.5]\nset ytics scale 0 ("
      << names_ << ")\nset grid noytics\nset xlabel 'time, s'\n"
      << bars_.str() << "plot NaN notitle\n";
    return {900, 64 + 30 * rows_, s.str()};
  }

 private:
  void add_bar(double from_s, double to_s, const std::string& text, const char* colour, int bar) {
    ++objects_;
    bars_ << "set object " << objects_ << " rect from " << from_s << ',' << -rows_ - 0.38 << " to " << to_s << ','
          << -rows_ + 0.38 << " fs solid " << (bar % 2 == 0 ? 0.38 : 0.2) << " noborder fc rgb '" << colour << "'\n";
    const double shown_s = record_.samples.back().t_s - record_.samples.front().t_s;
    const double width_px = 800 * (to_s - from_s) / std::max(shown_s, 1e-3);
    if (width_px < 7 * static_cast<double>(text.size()) + 4) return;  // it would run into its neighbour
    bars_ << "set label " << plot_quoted(text) << " at " << (from_s + to_s) / 2 << ',' << -rows_
          << " center font ',11' front\n";
  }

  const session::SessionRecord& record_;
  int rows_ = 0, objects_ = 0;
  std::string names_;
  std::ostringstream bars_;
};

PageFigure timeline(const session::SessionRecord& record, const Marks& marks) {
  Timeline bars(record);
  for (const PlotMark& mark : marks) bars.mark(mark);
  bars.row(
      "mode", [](const session::Sample& s) { return std::string(name(s.machine.mode)); }, kBlue);
  bars.row(
      "phase", [&record](const session::Sample& s) { return std::string(session::phase_name(record, s)); }, kGreen);
  bars.row(
      "contact", [](const session::Sample& s) { return session::in_contact(s) ? "contact" : ""; }, kVermilion);
  bars.row(
      "detected", [](const session::Sample& s) { return s.machine.contact ? "detected" : ""; }, kBlue);
  bars.row(
      "limited", [](const session::Sample& s) { return s.machine.limits != 0 ? "limited" : ""; }, kOrange);
  return {
      kTimeline,
      "Machine mode, phase of the operator's plan, true contact, contact detected by the estimator, and active limits "
      "of the safety gate.",
      bars.figure()};
}

void write_points(std::ostringstream& out, const std::string& name, const std::vector<PlanarVector>& points) {
  out << name << " << EOD\n";
  for (const PlanarVector& p : points) out << p.x() << ' ' << p.y() << '\n';
  out << "EOD\n";
}

const char* scene_colour(session::SceneLine::Kind kind) {
  static constexpr std::array kColours{kGrey, kVermilion, kPurple, kOrange, kSky};
  static_assert(kColours.size() == static_cast<std::size_t>(session::SceneLine::Kind::kVirtualWall) + 1);
  return kColours[static_cast<std::size_t>(kind)];
}

/// Rows far enough from the last one kept to be told apart in the plot.
std::vector<PlanarVector> thinned_path(const session::SessionRecord& record,
                                       const PlanarVector& (*point)(const session::Sample&), bool engaged_only) {
  constexpr double kStep_m = 0.004;
  std::vector<PlanarVector> path;
  for (const session::Sample& s : record.samples) {
    if (engaged_only && s.machine.mode != Mode::kEngaged) continue;
    if (path.empty() || (point(s) - path.back()).norm() > kStep_m) path.push_back(point(s));
  }
  return path;
}

PageFigure tip_path(const session::SessionResult& session) {
  const auto tip = thinned_path(
      session.record, [](const session::Sample& s) -> const PlanarVector& { return s.truth.tip_m; }, false);
  const auto commanded = thinned_path(
      session.record, [](const session::Sample& s) -> const PlanarVector& { return s.hand_setpoint_tip_m; }, true);
  Eigen::AlignedBox2d box;
  for (const auto* path : {&tip, &commanded})
    for (const PlanarVector& p : *path) box.extend(p);
  if (box.isEmpty()) box.extend(PlanarVector::Zero());
  const double margin_m = 0.25;
  std::ostringstream s;
  write_points(s, "$commanded", commanded);
  write_points(s, "$tip", tip);
  std::string curves;
  for (std::size_t i = 0; i < session.scene.size(); ++i) {
    const session::SceneLine& line = session.scene[i];
    auto points = line.points_m;
    if (line.closed && !points.empty()) points.push_back(points.front());
    const std::string block = "$s" + std::to_string(i);
    write_points(s, block, points);
    const bool named_before = std::any_of(session.scene.begin(), session.scene.begin() + static_cast<std::ptrdiff_t>(i),
                                          [&](const session::SceneLine& other) { return other.name == line.name; });
    curves += block + " using 1:2 with lines lw 1.5 lc rgb '" + scene_colour(line.kind) +
              (named_before ? "' notitle" : "' title ") + (named_before ? "" : plot_quoted(line.name)) + ", ";
  }
  s << plot_style() << "set size ratio -1\nset xrange [" << box.min().x() - margin_m << ':' << box.max().x() + margin_m
    << "]\nset yrange [" << box.min().y() - margin_m << ':' << box.max().y() + margin_m
    << "]\nset xlabel 'forward of the boom pin, m'\nset ylabel 'above the boom pin, m'\nplot " << curves
    << "$commanded using 1:2 with lines lw 1 dt 2 lc rgb '" << kInk
    << "' title 'commanded by the hand', $tip using 1:2 with lines lw 1.8 lc rgb '" << kBlue
    << "' title 'bucket tip'\n";
  const double aspect = (box.sizes().y() + 2 * margin_m) / (box.sizes().x() + 2 * margin_m);
  return {"Path of the bucket tip",
          "Drawn to scale, in the machine's frame.",
          {900, std::clamp(static_cast<int>(90 + 800 * aspect), 260, 620), s.str()}};
}

}  // namespace

std::vector<PageFigure> report_plots(const session::SessionResult& session, const std::vector<PlotMark>& marks) {
  const session::SessionRecord& record = session.record;
  return {timeline(record, marks),   tip_path(session),        angles(record, marks),
          valves(record, marks),     forces(record, marks),    felt(record, marks),
          felt_against_true(record), pressures(record, marks), energy(record, marks)};
}

std::string plot_showing(std::string_view metric) {
  if (metric == "net_energy_J") return kEnergy;
  const session::MetricEntry* const entry = session::find_metric(metric);
  const std::string_view group = entry == nullptr ? "" : entry->group;
  return group == "tracking" ? kAngles : group == "force" ? kForces : group == "felt" ? kFelt : kTimeline;
}

}  // namespace knuckle::report
