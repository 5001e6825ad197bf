// How much of its nominal flow a valve has been seen to let through: what machine files say of small openings may be
// many times too much (curved and notched edges, dead bands that have moved).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace knuckle::slave {

/// One direction of one valve. Ratio of seen to nominal travel by size of opening, least squares with forgetting.
class FlowShare {
 public:
  /// @param sure the nominal curve is this valve's own, to the file's accuracy; else flow is expected to begin with
  /// opening^2, which no curve in use falls short of by more than a few times.
  explicit FlowShare(bool sure) noexcept {
    for (std::size_t i = 0; i < kBins; ++i) {
      const double share = sure ? 1 : kUnknown * kUpTo[i];
      bins_[i] = {share * kPrior_m * kPrior_m, kPrior_m * kPrior_m, 0};
    }
  }
  /// (0, 1]: no valve is asked for more than its file's. What a smaller opening lets through counts for a larger one:
  /// curves only get steeper. What was seen of a bin is expected at its upper end only: an edge that a notch ends lets
  /// through twenty times as much there as at the lower one.
  [[nodiscard]] double at(double opening) const noexcept {
    const std::size_t last = index(opening);
    double below = 0, share = 0;
    for (std::size_t i = 0; i <= last; ++i) {
      below = share;
      share = std::max(share, bins_[i].seen / bins_[i].nominal);
    }
    const double from = last == 0 ? 0 : kUpTo[last - 1];
    const double within = std::min(1.0, (opening - from) / (kUpTo[last] - from));
    return std::min(1.0, last == 0 ? share : below + within * (share - below));
  }
  /// The valve would have let nominal_m of travel through in this step.
  void pass(double opening, double nominal_m) noexcept { bins_[index(opening)].passing_m += nominal_m; }
  /// Nothing is known of what passed: forget it.
  void drop() noexcept {
    for (Bin& bin : bins_) bin.passing_m = 0;
  }
  /// All that passed since the last call was seen as this travel.
  void see(double travel_m) noexcept {
    double passed_m = 0;
    for (const Bin& bin : bins_) passed_m += bin.passing_m;
    for (Bin& bin : bins_) {
      bin.seen += bin.passing_m * travel_m;
      bin.nominal += bin.passing_m * passed_m;
      const double kept = std::min(1.0, kRemembered_m * kRemembered_m / bin.nominal);
      bin.seen *= kept;
      bin.nominal *= kept;
      bin.passing_m = 0;
    }
  }

 private:
  struct Bin {
    double seen, nominal;  // m^2
    double passing_m;
  };
  static constexpr std::size_t kBins = 6;
  static constexpr std::array<double, kBins> kUpTo{0.04, 0.08, 0.16, 0.32, 0.64, 1};
  static constexpr double kUnknown = 0.12;  // of a bin's end: area from 0.12 to 0.24 opening^2
  static constexpr double kPrior_m = 0.001, kRemembered_m = 0.005;

  [[nodiscard]] static std::size_t index(double opening) noexcept {
    std::size_t i = 0;
    while (i + 1 < kBins && opening > kUpTo[i]) ++i;
    return i;
  }
  std::array<Bin, kBins> bins_;
};

}  // namespace knuckle::slave
