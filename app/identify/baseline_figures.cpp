#include "app/identify/baseline_figures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "app/report/panel_plot.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::identify {
namespace {

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::vector<double> times(std::size_t count, double step_s) {
  std::vector<double> t(count);
  for (std::size_t i = 0; i < count; ++i) t[i] = static_cast<double>(i) * step_s;
  return t;
}

report::PageFigure finished(const std::string& title, const std::string& caption, int panels,
                            const report::PanelPlot& plot, double first_s, double last_s) {
  return {title, caption, {900, report::panel_figure_height(panels), plot.finish(first_s, last_s)}};
}

std::vector<double> joint_angles_deg(const MachineDescription& machine, const estimation::Recording& recording,
                                     int joint) {
  const Kinematics kinematics(machine);
  std::vector<double> angle;
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    const double length_m = recording.samples[i].cylinder_m[joint] - machine.sensors.encoder_offset_m[joint];
    const auto found = recording.usable[i] != 0 ? kinematics.joint_at(joint, length_m) : std::nullopt;
    angle.push_back(found ? *found * kDegPerRad : kUnknown);
  }
  return angle;
}

/// From shortly before the joint leaves where it was to shortly after it comes to where it stays.
std::pair<double, double> moving(const std::vector<double>& angle_deg, double step_s) {
  constexpr double kMoved_deg = 1, kAround_s = 2;
  std::size_t first = 0, last = angle_deg.size();
  while (first < last && !(std::abs(angle_deg[first] - angle_deg.front()) > kMoved_deg)) ++first;
  while (last > first && !(std::abs(angle_deg[last - 1] - angle_deg.back()) > kMoved_deg)) --last;
  return {std::max(0.0, static_cast<double>(first) * step_s - kAround_s),
          static_cast<double>(last) * step_s + kAround_s};
}

/// A round number that parts the values' span into about four.
double round_step(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  if (low == high) return 1;
  const double rough = (*high - *low) / 4, decade = std::pow(10, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (rough <= factor * decade) return factor * decade;
  }
  return 10 * decade;
}

}  // namespace

report::PageFigure torque_figure(const std::string& title, const std::string& caption,
                                 const estimation::TorqueComparison& torque, const std::vector<int>& joints) {
  const std::vector<double> t = times(torque.usable.size(), torque.step_s);
  report::PanelPlot plot(static_cast<int>(joints.size()));
  for (const int joint : joints) {
    std::vector<double> measured, estimated;
    for (std::size_t i = 0; i < t.size(); ++i) {
      const bool known = torque.usable[i] != 0;
      measured.push_back(known ? torque.measured_Nm[i][joint] : kUnknown);
      estimated.push_back(known ? torque.modelled_Nm[i][joint] : kUnknown);
    }
    plot.panel(std::string(kJointNames[static_cast<std::size_t>(joint)]) + ", N m");
    plot.line(t, measured, "measured", report::kBlue, "lw 1.2");
    plot.line(t, estimated, "estimated", report::kVermilion, "dt 2 lw 1.6");
  }
  return finished(title, caption, static_cast<int>(joints.size()), plot, 0, t.empty() ? 1 : t.back());
}

report::PageFigure pressure_figure(const std::string& title, const MachineDescription& machine,
                                   const estimation::Recording& recording, int joint) {
  constexpr double kBarPerPa = 1e-5;
  const auto k = static_cast<std::size_t>(joint);
  const std::vector<double> t = times(recording.samples.size(), recording.step_s);
  const std::vector<double> angle = joint_angles_deg(machine, recording, joint);
  std::vector<double> head, rod;
  for (std::size_t i = 0; i < t.size(); ++i) {
    head.push_back(recording.usable[i] != 0 ? recording.samples[i].pressure_Pa[2 * k] * kBarPerPa : kUnknown);
    rod.push_back(recording.usable[i] != 0 ? recording.samples[i].pressure_Pa[2 * k + 1] * kBarPerPa : kUnknown);
  }
  report::PanelPlot plot(2);
  plot.panel(std::string(kJointNames[k]) + ", deg");
  plot.line(t, angle, "", report::kBlue);
  plot.panel("pressure, bar");
  plot.line(t, head, "A, head side", report::kVermilion, "lw 1.2");
  plot.line(t, rod, "B, rod side", report::kGreen, "lw 1.2");
  const auto [first_s, last_s] = moving(angle, recording.step_s);
  return finished(title, "Joint angle, and the pressures at both ports of its cylinder, while it moves.", 2, plot,
                  first_s, last_s);
}

report::PageFigure wrench_figure(const std::string& title, const std::string& caption, double step_s,
                                 const std::vector<Eigen::Vector3d>& wrench) {
  const std::vector<double> t = times(wrench.size(), step_s);
  std::array<std::vector<double>, 3> series;
  for (const Eigen::Vector3d& w : wrench) {
    for (std::size_t k = 0; k < series.size(); ++k) series[k].push_back(w[static_cast<Eigen::Index>(k)]);
  }
  report::PanelPlot plot(2);
  plot.panel("force, N");
  plot.line(t, series[0], "horizontal", report::kBlue, "lw 1.2");
  plot.line(t, series[1], "vertical", report::kVermilion, "lw 1.2");
  plot.panel("torque, N m");
  plot.line(t, series[2], "", report::kGreen, "lw 1.2");
  return finished(title, caption, 2, plot, 0, t.empty() ? 1 : t.back());
}

report::PageFigure pose_figure(const std::string& title, const std::string& caption,
                               const std::vector<PoseTorque>& torques) {
  std::ostringstream script;
  script << report::plot_style() << "set multiplot layout 1," << torques.size()
         << "\nset bmargin 3.5\nset lmargin 11\n";
  for (std::size_t n = 0; n < torques.size(); ++n) {
    script << "$p" << n << " << EOD\n";
    for (std::size_t i = 0; i < torques[n].measured_Nm.size(); ++i)
      script << torques[n].estimated_Nm[i] << ' ' << torques[n].measured_Nm[i] << '\n';
    script << "EOD\nset xtics " << round_step(torques[n].estimated_Nm) << "\nset xlabel "
           << report::plot_quoted(torques[n].joint + ", estimated, N m")
           << "\nset ylabel 'measured, N m'\nplot x with lines lc rgb '" << report::kGrey << "' notitle, $p" << n
           << " using 1:2 with points pt 7 ps 0.35 lc rgb '" << report::kBlue << "' notitle\n";
  }
  script << "unset multiplot\n";
  return {title, caption, {900, 320, script.str()}};
}

}  // namespace knuckle::identify
