// Identification in motion as Malaguti & Zaghi did it ("Force sensor by driving hydraulic cylinders", 3.2): stick and
// bucket as two links, no accelerations thanks to the filtered regressor, friction of both cylinders with it.
//
//   [Q_3, Q_2] = [tau_3, tau_2 - tau_3] = d/dt(Y_p phi) + Y_v phi + friction,  all of it through a / (s + a);
//   friction f_c sgn v + f_v v at the rod: r_3 in row 3; r_2, and minus what row 3 has, in row 2.
//
// The boom is a known moving base: its angle (tilt sensor and encoder) carries the links, its own parameters do not
// show. The paper treats the two rows as two problems; they share parameters, so here they are one, each row weighted
// with what it leaves over. Its misprints are listed in docs/theory.md.
#pragma once

#include <span>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/recording.h"
#include "estimation/regressor.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

/// The authors' own by default. Another filter and window are what repairs the inertias.
struct MalagutiOptions {
  double sampling_s = 0.01;  ///< Faster recordings are thinned.
  double window_s = 0.07;    ///< Savitzky-Golay, 2 n_w + 1 = 7 samples
  int order = 2;             ///< m
  double filter_Hz = 20;     ///< a / 2 pi
  double least_s = 20;       ///< Less motion is refused; the paper has 40 s.
};

/// The same with less noise in the columns: 2 Hz, and a cubic over 41 samples.
[[nodiscard]] constexpr MalagutiOptions repaired_malaguti_options() noexcept {
  return {.window_s = 0.41, .order = 3, .filter_Hz = 2};
}

inline constexpr int kMalagutiCount = 10;
using MalagutiVector = Eigen::Matrix<double, kMalagutiCount, 1>;

struct MalagutiResult {
  Identification summary;  ///< Table 2: phi_D1, phi_D2, phi_S1..S4, phi_f1..f4.
  MalagutiOptions options;
  /// J3, J2 [kg m^2], X3, Z3, X2, Z2 [kg m], f_c3 [N], f_v3 [N s/m], f_c2, f_v2 (link 2 the stick, 3 the bucket).
  MalagutiVector parameters = MalagutiVector::Zero();
};

/// Poor data is not thrown at: summary.usable is false and the reasons say why.
/// @throws InputError as Kinematics does.
[[nodiscard]] MalagutiResult identify_malaguti(const MachineDescription& machine, std::span<const Recording> recordings,
                                               const MalagutiOptions& options = {});

/// Torques of stick and bucket cylinder behind the filter, as the paper compares them; NaN for the boom. The first
/// samples after a gap are not usable.
[[nodiscard]] TorqueComparison compare_torque(const MalagutiResult& result, const MachineDescription& machine,
                                              const Recording& recording);

/// Force of the world on the tip, frame M, from stick and bucket alone (two unknowns from two torques). NaN where the
/// bucket is nearly in line with the stick.
[[nodiscard]] std::vector<PlanarVector> external_force(const MalagutiResult& result, const MachineDescription& machine,
                                                       const Recording& recording);

}  // namespace knuckle::estimation
