// What somebody types into the terminal of a program that runs, or writes into its standard input: lines, without
// waiting for any.
#pragma once

#include <optional>
#include <string>

#include "app/pairing/chosen_link.h"

namespace knuckle::programs {

class ControlInput {
 public:
  explicit ControlInput(int descriptor) : descriptor_(descriptor) {}
  /// The next line, without its end. Nothing where there is none, and for a program in the background of its terminal,
  /// which reading would stop.
  [[nodiscard]] std::optional<std::string> line();

 private:
  void read();
  int descriptor_;
  bool ended_ = false;
  std::string text_;
};

/// "release", "grant" or "take". @return what was done, in one line; empty for an empty line.
[[nodiscard]] std::string obey_control_line(const std::string& line, pairing::ChosenLink& link);

}  // namespace knuckle::programs
