// The session in pictures: machine, wall, loose piece and soil drawn to scale at the key moments.
#pragma once

#include <string>
#include <vector>

#include "app/session/session_result.h"

namespace knuckle::report {

/// A moment to be drawn.
struct Moment {
  std::size_t row = 0;
  std::string label;
};

/// At most kMostMoments, in time order: the end, faults, the first world event of each kind, then beginnings of phases.
inline constexpr std::size_t kMostMoments = 9;
[[nodiscard]] std::vector<Moment> key_moments(const session::SessionRecord& record);

struct Frame {
  double t_s = 0;
  std::string label;
  std::string svg;  ///< For use inside HTML; classes are styled by filmstrip_css().
};
/// All frames show the same part of the world at the same scale, with a bar of one metre.
[[nodiscard]] std::vector<Frame> filmstrip(const session::SessionResult& session);

/// Uses the page's custom properties --ink, --paper, --blue, --vermilion.
[[nodiscard]] std::string filmstrip_css();

}  // namespace knuckle::report
