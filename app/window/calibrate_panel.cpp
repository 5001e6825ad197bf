#include "app/window/calibrate_panel.h"

#include <utility>

#include "core/error.h"

namespace knuckle::app {

void CalibrationPanel::begin() {
  problem_.clear();
  try {
    job_.reset();
    state_ = {};
    seen_ = 0;
    accepted_ = false;
    job_ = std::make_unique<CalibrationJob>(plan);
  } catch (const InputError& error) {
    problem_ = error.what();
  }
}

void CalibrationPanel::update() {
  if (!job_) return;
  auto newer = job_->newer(seen_);
  if (!newer) return;
  if (newer->accepted && state_.stage != CalibrationStage::kOver) accepted_ = true;
  state_ = std::move(*newer);
}

void CalibrationPanel::answer(const std::string& word) {
  if (!job_) return;
  job_->answer(word);
  typed = {};
}

void CalibrationPanel::cancel() {
  if (job_) job_->cancel();
}

void CalibrationPanel::take_back() {
  try {
    const Acceptance& accepted = state_.accepted.value();
    roll_back(accepted);
    accepted_ = false;
    problem_ =
        "rolled back: " + accepted.file + (accepted.kept.empty() ? " is gone, as before" : " is the one before again");
  } catch (const InputError& error) {
    problem_ = error.what();
  }
}

}  // namespace knuckle::app
