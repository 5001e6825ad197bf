// What a command writes for people, printable whatever files, devices or the network put into it.
#pragma once

#include <ostream>

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

}  // namespace knuckle::cli
