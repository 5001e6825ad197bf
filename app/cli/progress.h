// A progress bar on a terminal; nothing in a pipe or a log file.
#pragma once

#include <string>
#include <utility>

#include "app/cli/interrupt.h"

namespace knuckle::cli {

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

/// Does `work` behind a bar, handing it a function that takes the share done, which throws Interrupted once a signal
/// has come.
template <typename Work>
auto watched(const InterruptGuard& interrupt, std::string title, const Work& work) {
  ProgressBar bar(std::move(title));
  return work([&](double done) {
    interrupt.check();
    bar.show(done);
  });
}

}  // namespace knuckle::cli
