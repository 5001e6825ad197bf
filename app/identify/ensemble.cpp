#include "app/identify/ensemble.h"

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include "app/cli/interrupt.h"
#include "app/identify/scores.h"
#include "core/error.h"
#include "core/symmetric_eigen.h"

namespace knuckle::identify {
namespace {

constexpr std::uint64_t kSeedsApart = 0x4000'0000'0000'0000;  // from those of machines that are judged

struct Member {
  CalibrationVector error;  ///< Identified minus true parameters.
  CalibrationMatrix told;   ///< Covariance from the residuals alone.
};

/// @throws std::runtime_error where it cannot be driven or identified, Interrupted once a signal has come.
Member member(const MachineDescription& nominal, const CommissionPlan& plan, bool calibrate_geometry,
              std::uint64_t seed) {
  const sim::MachineTruth truth = sim::sample_truth(nominal, seed);
  const CommissionRuns runs = run_commissioning(nominal, truth, plan, seed, [](double) { cli::check_interrupt(); });
  estimation::FullOptions full;
  full.usual_errors = false;  // the ensemble measures them
  const Commissioned found = calibrate(nominal, runs, {calibrate_geometry, full});
  if (!found.full.summary.usable) throw std::runtime_error(found.full.summary.reasons.front());
  const CalibrationVector truly =
      true_parameters(calibrated(found.machine), runs, found.full.dynamics, truth.hull_pitch_rad);
  return {found.full.dynamics.parameters - truly, found.full.dynamics.covariance};
}

/// Directions of less than no variance are taken out, with every parameter in units of its own `variance`.
CalibrationMatrix positive_part(const CalibrationMatrix& matrix, const CalibrationVector& variance) {
  const CalibrationVector sigma = variance.cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt();
  const CalibrationMatrix scaled = sigma.cwiseInverse().asDiagonal() * matrix * sigma.cwiseInverse().asDiagonal();
  const SymmetricEigen modes = symmetric_eigen(scaled);
  const CalibrationMatrix clipped = modes.vectors * modes.values.cwiseMax(0).asDiagonal() * modes.vectors.transpose();
  return sigma.asDiagonal() * clipped * sigma.asDiagonal();
}

}  // namespace

void parallel_for(std::size_t count, int jobs, const std::function<void(std::size_t)>& work,
                  const std::function<void(double)>& progress) {
  if (jobs <= 0) jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::atomic<std::size_t> next{0}, done{0};
  std::atomic<int> running{jobs};
  std::exception_ptr failure;
  std::mutex failing;
  const auto fail = [&] {
    const std::scoped_lock lock(failing);
    if (!failure) failure = std::current_exception();
    next = count;
  };
  std::vector<std::jthread> threads;
  for (int j = 0; j < jobs; ++j) {
    threads.emplace_back([&] {
      try {
        for (std::size_t i = next++; i < count; i = next++) {
          work(i);
          ++done;
        }
      } catch (...) {
        fail();
      }
      --running;
    });
  }
  while (running > 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    try {
      if (progress) progress(static_cast<double>(done) / static_cast<double>(count));
    } catch (...) {
      fail();
    }
  }
  threads.clear();
  if (failure) std::rethrow_exception(failure);
}

CalibrationMatrix model_error(const MachineDescription& nominal, const CommissionPlan& plan, bool calibrate_geometry,
                              int machines, std::uint64_t seed, int jobs, const std::function<void(double)>& progress) {
  std::vector<std::optional<Member>> members(static_cast<std::size_t>(machines));
  std::vector<std::string> reasons(members.size());
  parallel_for(
      members.size(), jobs,
      [&](std::size_t i) {
        try {
          members[i] = member(nominal, plan, calibrate_geometry, kSeedsApart + seed + i);
        } catch (const std::runtime_error& error) {
          reasons[i] = error.what();
        }
      },
      progress);
  CalibrationMatrix squares = CalibrationMatrix::Zero(), told = CalibrationMatrix::Zero();
  int usable = 0;
  for (const auto& one : members) {
    if (!one) continue;
    squares += one->error * one->error.transpose();
    told += one->told;
    ++usable;
  }
  if (usable < 2) {
    const auto reason = std::find_if(reasons.begin(), reasons.end(), [](auto& text) { return !text.empty(); });
    throw InputError("ensemble: fewer than 2 of " + std::to_string(machines) +
                     " machines were usable: use more of them (--ensemble); " + *reason);
  }
  return positive_part((squares - told) / usable, squares.diagonal() / usable);
}

}  // namespace knuckle::identify
