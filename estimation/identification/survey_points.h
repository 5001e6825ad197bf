// Which points of a survey can be this machine's at all; what cannot is named.
#pragma once

#include <string>
#include <vector>

#include "estimation/identification/survey_geometry.h"

namespace knuckle::estimation {

inline constexpr std::array<const char*, kJoints> kPointNames{"arm pin", "bucket pin", "tip"};

struct SurveyPoints {
  std::vector<SurveyPoint> points;
  std::size_t poses = 0;              ///< With at least one point.
  std::vector<std::string> left_out;  ///< Poses and points that are not among `points`.
  std::vector<std::string> refusals;  ///< Reasons for which the survey is of no use; empty where it is.
};

/// Poses whose encoder readings the drawing can reach, and their points as far as within 5 % of the machine's reach and
/// five sigma of the drawing's tolerances of where the drawing has them. Refused as a whole: too few poses, joints that
/// hardly moved, points that are off in the median (with the mistake that explains it: millimetres, a mirrored axis,
/// swapped columns).
[[nodiscard]] SurveyPoints select_points(const MachineDescription& nominal, const Survey& survey);

}  // namespace knuckle::estimation
