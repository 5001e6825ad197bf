// Something that has happened while a program runs, for its terminal.
#pragma once

#include <string>

namespace knuckle::cli {

struct News {
  std::string what;  ///< One line.
  /// Makes it another event than those before: its text without times, values, and what a far end may choose freely.
  std::string kind;
};

}  // namespace knuckle::cli
