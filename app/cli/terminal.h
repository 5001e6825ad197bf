// What a command writes for people, printable whatever files, devices or the network put into it.
#pragma once

#include <cstddef>
#include <ostream>
#include <string>
#include <utility>

#include "app/cli/interrupt.h"
#include "app/cli/text_buffer.h"

namespace knuckle::cli {

/// While it lives, all that is written into the stream reaches its destination with control characters made visible
/// (printable_lines). Line ends and tabs stay. For one thread.
class PrintableOutput {
 public:
  explicit PrintableOutput(std::ostream& stream);
  /// Passes on what is left.
  ~PrintableOutput();
  PrintableOutput(const PrintableOutput&) = delete;
  PrintableOutput& operator=(const PrintableOutput&) = delete;

 private:
  std::ostream& stream_;
  std::streambuf* destination_;
  TextBuffer buffer_;
};

// Help for a terminal: lines broken between words, never inside a name.

/// Lines longer than `width` go on below where their description begins: behind the first gap of two spaces or more.
/// A word that is longer than the room for it stays whole.
[[nodiscard]] std::string wrapped(const std::string& text, std::size_t width);

/// Of the terminal that standard output is; 0 where it is none.
[[nodiscard]] std::size_t terminal_width();

// A progress bar on a terminal; nothing in a pipe or a log file.

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

// Something that has happened while a program runs, for its terminal.

struct News {
  std::string what;  ///< One line.
  /// Makes it another event than those before: its text without times, values, and what a far end may choose freely.
  std::string kind;
};

}  // namespace knuckle::cli
