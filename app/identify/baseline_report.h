// The papers' results again, on data of ours: their tables and figures in their layout, as one HTML page a method.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/motion/machine_run.h"
#include "app/report/html.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/recording.h"
#include "estimation/regressor.h"
#include "machine/description.h"
#include "machine/description_fwd.h"
#include "sim/truth.h"

namespace knuckle::identify {

// The two papers' experiments on the simulated machine, and what the simulator says their answers should have been.

/// M's poses, M's digging, K's slow motion.
enum class Paper : std::uint8_t { kStatic, kMalaguti, kKim };
/// As it is called on command lines and in results: "static", "malaguti", "kim".
[[nodiscard]] const char* name(Paper paper) noexcept;
/// Nothing where none is called so.
[[nodiscard]] std::optional<Paper> paper_named(std::string_view name) noexcept;

/// Pressures that the method needs and this machine does not measure, as "the pressures of arm and bucket"; empty: it
/// has all. kStatic takes arm and bucket, as M does, where the boom's are missing.
[[nodiscard]] std::string missing_for(Paper paper, const MachineDescription& machine);

struct BaselineRuns {
  std::vector<motion::MachineRecording> identification, verification;
};

/// Drives the machine as the paper did: kStatic 170 poses and 40 others to verify with, kMalaguti 40 s of digging in
/// the air and another 40 s to verify with, kKim each joint slowly in turn and two verification runs.
/// @param machine as the controller of `run` sees it; @param seed of poses and digging.
/// @throws std::runtime_error as MachineRun does.
[[nodiscard]] BaselineRuns run_baseline(Paper paper, const MachineDescription& machine, motion::MachineRun& run,
                                        std::uint64_t seed);

/// What the base parameters should be: projection of the torques that really moved the links on the regressor, along
/// these runs. The cylinders' masses, which have no place of their own in it, are spread as they showed.
[[nodiscard]] estimation::BaseParameters projected_parameters(const sim::MachineTruth& truth,
                                                              std::span<const motion::MachineRecording> runs);

/// True values by the names that the paper gives its parameters; what a simulated machine has no such thing of (a
/// friction at the joint) is left out: of kKim f_c1, f_v1 ... are those of the cylinders instead. Projected along the
/// verification where there is one.
/// @param machine as identified with: K's m2 and m3 are taken off as they were.
[[nodiscard]] std::map<std::string, double> baseline_truth(Paper paper, const MachineDescription& machine,
                                                           const sim::MachineTruth& truth, const BaselineRuns& runs);

/// How M's inertias depend on noise and settings: one row a variant, over several sampled machines.
struct InertiaBias {
  std::string variant;
  std::vector<double> stick, bucket;  ///< Identified over true J2, J3, one a machine.
  int intervals = 0,
      covered = 0;  ///< Of the six inertial parameters: naive 95 % intervals that contain the true value.
};

/// @param progress done share in [0, 1]; may throw to end it.
/// Variants: the authors' settings on the sensors' values; on exact rod lengths; on those with 0.1 mm of noise;
/// a 2 Hz filter with a 41-sample cubic.
[[nodiscard]] std::vector<InertiaBias> malaguti_bias(const MachineDescription& machine, std::uint64_t first_seed,
                                                     int machines, const std::function<void(double)>& progress = {});

// Figures of the baseline reports.

/// Measured (full) and estimated (dashed) torque of these joints, a panel each.
/// @param by_default what the default method estimates of the same recording: where it is given, it is drawn as well,
/// and below each joint the error of both.
[[nodiscard]] report::PageFigure torque_figure(const std::string& title, const std::string& caption,
                                               const estimation::TorqueComparison& torque,
                                               const std::vector<int>& joints,
                                               const estimation::TorqueComparison* by_default = nullptr);

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

/// A row of the paper's own table of parameters.
struct PrintedParameter {
  std::string symbol;  ///< HTML, with what it is: "φ<sub>D1</sub>, bucket J".
  std::string value;   ///< Of the paper's machine, with its standard deviation where it is given; "-": not printed.
};
/// In the order of the method's results.
[[nodiscard]] std::vector<PrintedParameter> printed_parameters(Paper paper);

/// K's m_i L_i at the angle A_i [kg m], in link axes, of base parameters that carry the later links' masses.
/// @param machine whose m2 and m3 are taken off.
[[nodiscard]] PlanarVector own_moment(const MachineDescription& machine, const estimation::BaseParameters& base,
                                      int link);

struct BaselineData {
  std::vector<estimation::Recording> identification;
  std::vector<estimation::Recording> verification;  ///< Not identified with; may be empty.
  std::map<std::string, double> truth;              ///< baseline_truth of a simulated machine; else empty.
  std::vector<InertiaBias> bias;                    ///< malaguti_bias, for kMalaguti; empty: left out.
  estimation::Identification verdict{};             ///< As `knuckle identify` judged it: usable, and why not.
};

/// Identifies by the paper's method with the authors' settings and writes the page:
/// kStatic: table 1 of M (for all three links) and the torques of every pose.
/// kMalaguti: tables 2 and 3, figures 3 and 4 of M, beside the same with a slower filter and a longer window.
/// kKim: table 1, figures 4 to 8 of K.
/// Figures 3 and 4 are of the first verification, figure 8 of the last, or of the identification where there is none.
/// @param machine as calibrated().
/// @throws InputError where gnuplot is missing.
void write_baseline_report(Paper paper, const MachineDescription& machine, const BaselineData& data, std::ostream& out);

}  // namespace knuckle::identify
