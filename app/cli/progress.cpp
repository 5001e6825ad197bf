#include "app/cli/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace knuckle::cli {
namespace {
constexpr int kCells = 40;
}

ProgressBar::ProgressBar(std::string title) : title_(std::move(title)), on_terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (on_terminal_ && shown_permille_ >= 0) std::fputs("\r\033[K", stderr);
}

void ProgressBar::show(double done_fraction) {
  const int permille = static_cast<int>(1000 * std::clamp(done_fraction, 0.0, 1.0));
  if (!on_terminal_ || permille == shown_permille_) return;
  shown_permille_ = permille;
  std::string bar;
  for (int i = 0; i < kCells; ++i) bar += i * 1000 < permille * kCells ? "█" : "░";
  std::fprintf(stderr, "\r%s %s %3d %%", title_.c_str(), bar.c_str(), permille / 10);
  std::fflush(stderr);
}

}  // namespace knuckle::cli
