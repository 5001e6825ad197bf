// Whether a recording's labels can be right, by physics that needs no areas, masses or geometry: each hypothesis says
// what a correctly labelled cylinder must do, and the recording's cycles vote.
#pragma once

#include <vector>

#include "app/recordings/csv_reader.h"
#include "core/joints.h"

namespace knuckle::studies {

/// Head and rod side of one cylinder: as labelled, or exchanged. A cylinder force is F = p_head - r p_rod [Pa], with
/// the area ratio r unknown within 0.4 ... 0.75; extension lifts the boom, draws the arm in and curls the bucket.
/// - Work: soil and friction take energy, so the sum of F dL over a dig cycle is positive. Its share is that sum over
///   the sum of |F dL|; the hypothesis with the higher share gets the cycle's vote.
/// - Load: in the air, F must have the sign that carries the arm's weight: boom pushed, arm and bucket by which side of
///   their pin they hang on. The hypothesis with the right sign in more rows gets the cycle's vote.
/// Odds of a test for n of m votes: (n + 1) / (m - n + 1), at the area ratio for which they are closest to even; the
/// odds of both tests multiply.
struct SideVerdict {
  int joint = 0;
  struct Test {
    std::size_t cycles = 0, votes_for_exchange = 0;
    double labelled = 0, exchanged = 0;  ///< Share of work; share of rows with the right sign; at area ratio 0.55.
  } work, load;
  bool exchanged = false;
  double confidence = 0;  ///< Of what `exchanged` says.
};
[[nodiscard]] std::vector<SideVerdict> judge_sides(const std::vector<recordings::MappedTable>& cycles);

/// How often channels change from row to row.
struct RefreshVerdict {
  double angles = 0, pressures = 0;  ///< Share of rows in which any channel of the kind changes.
  double tip_with_angles = 0;        ///< Share of rows in which angles and tip both change or both do not.
};
[[nodiscard]] RefreshVerdict judge_refresh(const std::vector<recordings::MappedTable>& cycles);

}  // namespace knuckle::studies
