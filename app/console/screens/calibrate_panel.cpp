#include "app/console/screens/calibrate_panel.h"

#include <charconv>
#include <utility>

#include "core/error.h"
#include "machine/toml_reader.h"

namespace knuckle::console::screens {

void CalibrationPanel::begin() {
  problem_.clear();
  refused_.clear();
  try {
    job_ = std::make_unique<CalibrationJob>(plan);  // where it is refused, the one before can still be rolled back
    state_ = {};
    seen_ = 0;
    accepted_ = false;
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
  refused_.clear();
}

void CalibrationPanel::enter() {
  if (!state_.question || !state_.question->bounds) return;
  const auto& [low, high] = *state_.question->bounds;
  const std::string text = typed.data();
  double value = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool number = end.ec == std::errc() && end.ptr == text.data() + text.size();
  if (number && value >= low && value <= high) return answer(text);
  typed = {};
  refused_ = text + " is not within " + number_text(low) + " to " + number_text(high) + ": enter another value";
}

void CalibrationPanel::cancel() {
  if (job_) job_->cancel();
}

void CalibrationPanel::take_back() {
  try {
    const Acceptance& accepted = state_.accepted.value();
    const std::string kept = roll_back(accepted);
    accepted_ = false;
    problem_ = "rolled back: " + accepted.file +
               (accepted.kept.empty() ? " is removed, there was none before" : " is the previous one again") +
               "; the accepted one is kept as " + kept;
  } catch (const InputError& error) {
    problem_ = error.what();
  }
}

}  // namespace knuckle::console::screens
