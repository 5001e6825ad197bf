// What the Calibrate screen keeps: the job, its last state, and what the person types.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "app/console/calibration_job.h"
#include "app/console/widgets/units.h"

namespace knuckle::console::screens {

class CalibrationPanel {
 public:
  CalibrationPlan plan;  ///< What the next job works by.
  /// Text of a number being typed.
  std::array<char, 16> typed{};
  bool typing = false;  ///< Into its field, in the frame drawn last.

  [[nodiscard]] bool begun() const noexcept { return job_ != nullptr; }
  [[nodiscard]] bool running() const noexcept { return job_ && state_.stage != CalibrationStage::kOver; }
  [[nodiscard]] const CalibrationState& state() const noexcept { return state_; }
  /// nullptr: nothing was begun.
  [[nodiscard]] CalibrationJob* job() noexcept { return job_.get(); }
  /// What went wrong last, in one line; empty: nothing.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }
  [[nodiscard]] bool can_roll_back() const noexcept { return accepted_; }

  void begin();
  /// Takes the job's newest state; once a frame.
  void update();
  void answer(const std::string& word);
  /// Answers with the number typed, in the units that are shown; a number outside the question's bounds is refused, and
  /// the question stays open.
  void enter(const widgets::Units& units);
  /// What a number of the question is multiplied by to be shown, and the unit then.
  [[nodiscard]] static std::pair<double, const char*> shown_unit(const bringup::Question& question,
                                                                 const widgets::Units& units);
  /// Why the number typed last was refused; empty: it was not.
  [[nodiscard]] const std::string& refused() const noexcept { return refused_; }
  void cancel();
  void take_back();

 private:
  std::unique_ptr<CalibrationJob> job_;
  CalibrationState state_;
  std::uint64_t seen_ = 0;
  bool accepted_ = false;
  std::string problem_, refused_;
};

}  // namespace knuckle::console::screens
