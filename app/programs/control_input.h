// What somebody types into the terminal of a program that runs, or writes into its standard input: lines, without
// waiting for any.
#pragma once

#include <string>
#include <vector>

#include "app/pairing/chosen_link.h"

namespace knuckle::programs {

class ControlInput {
 public:
  explicit ControlInput(int descriptor) : descriptor_(descriptor) {}
  /// Lines that have come, without their ends, and of a very long one its beginning: some hundred bytes each time. None
  /// for a program in the background of its terminal, which reading would stop.
  [[nodiscard]] std::vector<std::string> lines();

 private:
  int descriptor_;
  bool ended_ = false;
  std::string text_;  // of a line that has not ended
};

/// Does what the lines say: "release", "grant" or "take". @return what was done.
[[nodiscard]] std::vector<cli::News> obey_control_lines(ControlInput& input, pairing::ChosenLink& link);

}  // namespace knuckle::programs
