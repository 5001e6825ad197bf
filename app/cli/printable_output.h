// What a command writes for people, printable whatever files, devices or the network put into it.
#pragma once

#include <cstddef>
#include <ostream>
#include <string>

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

}  // namespace knuckle::cli
