// A progress bar on a terminal; nothing in a pipe or a log file.
#pragma once

#include <string>

namespace knuckle::app {

class ProgressBar {
 public:
  /// Draws on standard error where that is a terminal.
  explicit ProgressBar(std::string title);
  /// Clears the bar.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(double done_fraction);

 private:
  std::string title_;
  bool on_terminal_;
  int shown_permille_ = -1;
};

}  // namespace knuckle::app
