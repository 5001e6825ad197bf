// Figures of the baseline reports.
#pragma once

#include <string>
#include <vector>

#include "app/report/html.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/recording.h"
#include "machine/description_fwd.h"

namespace knuckle::identify {

/// Measured (full) and estimated (dashed) torque of these joints, a panel each.
[[nodiscard]] report::PageFigure torque_figure(const std::string& title, const std::string& caption,
                                               const estimation::TorqueComparison& torque,
                                               const std::vector<int>& joints);

/// Angle of one joint and the pressures of its cylinder, while that joint moves.
[[nodiscard]] report::PageFigure pressure_figure(const std::string& title, const MachineDescription& machine,
                                                 const estimation::Recording& recording, int joint);

/// Force and torque at the bucket tip, (Fx, Fz, torque) a sample.
[[nodiscard]] report::PageFigure wrench_figure(const std::string& title, const std::string& caption, double step_s,
                                               const std::vector<Eigen::Vector3d>& wrench);

/// Measured over estimated torque of resting poses, one cloud a joint; the diagonal is a perfect model.
struct PoseTorque {
  std::string joint;
  std::vector<double> measured_Nm, estimated_Nm;
};
[[nodiscard]] report::PageFigure pose_figure(const std::string& title, const std::string& caption,
                                             const std::vector<PoseTorque>& torques);

}  // namespace knuckle::identify
