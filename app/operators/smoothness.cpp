#include "app/operators/smoothness.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

namespace knuckle::operators {
namespace {

constexpr double kHighest_Hz = 10;
constexpr double kLeastPart = 0.05;
constexpr std::size_t kPadding = 16;

}  // namespace

std::optional<double> spectral_arc_length(const std::vector<double>& speed, double step_s) {
  if (speed.size() < 4) return std::nullopt;
  std::vector<double> padded = speed;
  padded.resize(kPadding * std::bit_ceil(speed.size()), 0.0);
  std::vector<std::complex<double>> spectrum;
  Eigen::FFT<double>().fwd(spectrum, padded);
  const double whole = std::abs(spectrum.front());
  if (!(whole > 0)) return std::nullopt;
  const double bin_Hz = 1 / (step_s * static_cast<double>(padded.size()));
  const auto bins = std::min(padded.size() / 2, static_cast<std::size_t>(kHighest_Hz / bin_Hz) + 1);
  std::size_t last = 0;
  for (std::size_t i = 0; i < bins; ++i) {
    if (std::abs(spectrum[i]) >= kLeastPart * whole) last = i;
  }
  double length = 0;
  for (std::size_t i = 1; i <= last; ++i)
    length += std::hypot(1 / static_cast<double>(last), (std::abs(spectrum[i]) - std::abs(spectrum[i - 1])) / whole);
  return -length;
}

int velocity_peaks(const std::vector<double>& speed, double least) noexcept {
  int peaks = 0;
  bool rising = true;
  double low = 0, high = 0;
  for (const double now : speed) {
    high = std::max(high, now);
    low = std::min(low, now);
    if (rising && high - low >= least && high - now >= least) {
      ++peaks;
      rising = false;
      low = now;
    } else if (!rising && now - low >= least) {
      rising = true;
      high = now;
    }
  }
  return peaks;
}

}  // namespace knuckle::operators
