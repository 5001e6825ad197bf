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

std::pair<double, const char*> CalibrationPanel::shown_unit(const bringup::Question& question,
                                                            const widgets::Units& units) {
  constexpr widgets::Quantity kLength = widgets::Quantity::kSmallLength;
  if (question.unit == "mm") return {units.convert(kLength, 1e-3), units.unit(kLength)};
  return {1, question.unit.c_str()};
}

void CalibrationPanel::enter(const widgets::Units& units) {
  if (!state_.question || !state_.question->bounds) return;
  const auto& [low, high] = *state_.question->bounds;
  const auto [factor, unit] = shown_unit(*state_.question, units);
  const std::string text = typed.data();
  double value = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool number = end.ec == std::errc() && end.ptr == text.data() + text.size();
  const double asked = value / factor;
  if (number && asked >= low && asked <= high) return answer(factor == 1 ? text : number_text(asked));
  typed = {};
  refused_ = text + " is not within " + widgets::shown("%.4g to %.4g", low * factor, high * factor).c_str() + " " +
             unit + ": enter another value";
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
