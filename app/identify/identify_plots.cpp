#include "app/identify/identify_plots.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "app/report/panel_plot.h"
#include "machine/kinematics.h"

namespace knuckle::identify {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

std::vector<double> times(std::size_t count, double step_s) {
  std::vector<double> t;
  for (std::size_t i = 0; i < count; ++i) t.push_back(step_s * static_cast<double>(i));
  return t;
}

/// One joint of a comparison, gaps where it is not usable.
std::vector<double> column_kNm(const estimation::TorqueComparison& c, const std::vector<JointVector>& values,
                               int joint) {
  std::vector<double> y;
  for (std::size_t i = 0; i < values.size(); ++i) y.push_back(c.usable[i] != 0 ? 1e-3 * values[i][joint] : kGap);
  return y;
}

report::PageFigure torque_figure(const std::string& source, const estimation::TorqueComparison& c) {
  report::PanelPlot plot(2 * kJoints);
  const std::vector<double> t = times(c.measured_Nm.size(), c.step_s);
  for (int j = 0; j < kJoints; ++j) {
    const std::string name = kJointNames[static_cast<std::size_t>(j)];
    const std::vector<double> measured = column_kNm(c, c.measured_Nm, j), modelled = column_kNm(c, c.modelled_Nm, j);
    std::vector<double> residual;
    for (std::size_t i = 0; i < t.size(); ++i) residual.push_back(1e3 * (measured[i] - modelled[i]));
    plot.panel(name + " torque, kN m");
    plot.line(t, measured, "measured", report::kGrey);
    plot.line(t, modelled, "modelled", report::kBlue);
    plot.panel(name + " error, N m");
    plot.line(t, residual, "measured - modelled", report::kVermilion, "lw 1");
  }
  return {"Torque: " + report::escaped(source),
          "Held-out motion: joint torque from cylinder pressures, torque of the identified model, and the difference.",
          {900, report::panel_figure_height(2 * kJoints), plot.finish(0, t.empty() ? 1 : t.back())}};
}

/// F_f at a steady speed: Dahl state settled, no load.
double friction_N(const FrictionCalibration& f, double v_mps) {
  const double coulomb = v_mps > 0 ? f.coulomb_extend_N : -f.coulomb_retract_N;
  const double stribeck = std::copysign(f.breakaway_N, v_mps) * std::exp(-std::pow(v_mps / f.stribeck_mps, 2));
  return coulomb + stribeck + f.viscous_Ns_per_m * v_mps;
}

/// One standard deviation of it, by the gradient over the parameters.
double friction_sigma_N(const DynamicsCalibration& d, int joint, double v_mps) {
  CalibrationVector gradient = CalibrationVector::Zero();
  gradient[friction_index(joint, v_mps > 0 ? kCoulombExtend : kCoulombRetract)] = v_mps > 0 ? 1 : -1;
  gradient[friction_index(joint, kBreakaway)] =
      std::copysign(std::exp(-std::pow(v_mps / d.stribeck_mps[joint], 2)), v_mps);
  gradient[friction_index(joint, kViscous)] = v_mps;
  return std::sqrt(std::max(0.0, gradient.dot(d.covariance * gradient)));
}

FrictionCalibration nominal_friction(const FrictionDescription& f) {
  return {f.coulomb_N, f.coulomb_N, f.viscous_Ns_per_m, f.coulomb_N * (f.static_ratio - 1), f.stribeck_mps, 0};
}

/// gnuplot data block: speed [mm/s], then [kN] identified, low, high, drawing; a blank line where the direction
/// changes.
std::string friction_block(const MachineDescription& machine, int joint) {
  const DynamicsCalibration& dynamics = *machine.dynamics_calibration;
  const FrictionCalibration found = dynamics.friction(joint);
  const FrictionCalibration nominal = nominal_friction(machine.cylinders[static_cast<std::size_t>(joint)].friction);
  std::ostringstream block;
  constexpr int kPoints = 121;
  constexpr double kFastest_mps = 0.12;
  for (int i = 0; i < kPoints; ++i) {
    const double v = -kFastest_mps + 2 * kFastest_mps * i / (kPoints - 1);
    if (std::abs(v) < 1e-9) {
      block << '\n';
      continue;
    }
    const double force = 1e-3 * friction_N(found, v), sigma = 1e-3 * friction_sigma_N(dynamics, joint, v);
    block << 1e3 * v << ' ' << force << ' ' << force - 2 * sigma << ' ' << force + 2 * sigma << ' '
          << 1e-3 * friction_N(nominal, v) << '\n';
  }
  return block.str();
}

report::PageFigure data_figure(const MachineDescription& machine, const estimation::Recording& recording) {
  const Kinematics kinematics(machine);
  report::PanelPlot plot(2 * kJoints);
  const std::vector<double> t = times(recording.samples.size(), recording.step_s);
  for (int j = 0; j < kJoints; ++j) {
    const auto k = static_cast<std::size_t>(j);
    std::vector<double> angle, head, rod;
    for (std::size_t i = 0; i < t.size(); ++i) {
      const estimation::Measurement& m = recording.samples[i];
      const bool usable = recording.usable[i] != 0;
      const auto theta = kinematics.joint_at(j, m.cylinder_m[j] - machine.sensors.encoder_offset_m[j]);
      angle.push_back(usable && theta ? *theta * 180 / std::numbers::pi : kGap);
      head.push_back(usable ? 1e-5 * m.pressure_Pa[2 * k] : kGap);
      rod.push_back(usable ? 1e-5 * m.pressure_Pa[2 * k + 1] : kGap);
    }
    plot.panel(std::string(kJointNames[k]) + ", deg");
    plot.line(t, angle, "", report::kBlue);
    plot.panel(std::string(kJointNames[k]) + ", bar");
    plot.line(t, head, "A, head side", report::kVermilion, "lw 1");
    plot.line(t, rod, "B, rod side", report::kGreen, "lw 1");
  }
  return {"Data: " + report::escaped(recording.source),
          "Data used for identification: joint angles from the encoders, cylinder pressures. Gaps were not used.",
          {900, report::panel_figure_height(2 * kJoints), plot.finish(0, t.empty() ? 1 : t.back())}};
}

}  // namespace

std::vector<report::PageFigure> torque_figures(const IdentifyData& data, const Identified& result) {
  std::vector<report::PageFigure> figures;
  for (std::size_t i = 0; i < result.comparisons.size(); ++i)
    figures.push_back(torque_figure(data.hold_out[i].source, result.comparisons[i]));
  return figures;
}

std::vector<report::PageFigure> friction_figures(const Identified& result) {
  if (!result.machine.dynamics_calibration || result.summary.parameters.empty()) return {};
  std::ostringstream data, plots;
  constexpr double kLeft = 0.07, kWidth = 0.25, kApart = 0.08;
  for (int j = 0; j < kJoints; ++j) {
    const std::string name = kJointNames[static_cast<std::size_t>(j)];
    data << "$" << name << " << EOD\n" << friction_block(result.machine, j) << "EOD\n";
    const double left = kLeft + j * (kWidth + kApart);
    plots << "set lmargin at screen " << left << "\nset rmargin at screen " << left + kWidth << "\nset ylabel '" << name
          << " friction, kN'\n"
          << (j == 1 ? "unset key\n" : "") << "plot $" << name << " using 1:3:4 with filledcurves fc rgb '"
          << report::kSky << "' fs transparent solid 0.35 noborder title '±2 sigma', $" << name
          << " using 1:2 with lines lc rgb '" << report::kBlue << "' lw 2 title 'identified', $" << name
          << " using 1:5 with lines lc rgb '" << report::kGrey << "' dt 2 lw 1.5 title 'drawing'\n";
  }
  return {{"Friction of the cylinders",
           "Without load, at a steady speed; extending to the right.",
           {900, 380,
            report::plot_style() + data.str() +
                "set multiplot\nset tmargin at screen 0.79\nset bmargin at screen 0.15\nset xlabel 'speed, mm/s'\n"
                "set xrange [-120:120]\nset xtics 60\nset key at screen 0.97, screen 0.98 right "
                "top\n" +
                plots.str() + "unset multiplot\n"}}};
}

std::vector<report::PageFigure> data_figures(const IdentifyData& data) {
  std::vector<report::PageFigure> figures;
  const MachineDescription machine = calibrated(data.machine);
  for (const estimation::Recording& recording : data.training) figures.push_back(data_figure(machine, recording));
  return figures;
}

}  // namespace knuckle::identify
