// Asks a person whether a code is the one on the other computer, and keeps nobody waiting meanwhile.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace knuckle::pairing {

class CodePrompt {
 public:
  enum class Answer : std::uint8_t { kYes, kNo, kEnded };  ///< kEnded: no more lines will come.

  explicit CodePrompt(int descriptor) : descriptor_(descriptor) {}
  /// Puts the question on standard output. What was typed into a terminal before it answers nothing.
  void ask();
  /// Never waits. Another line than yes or no, y or n, in any case, is asked again. @return nothing: not answered yet.
  [[nodiscard]] std::optional<Answer> answer();

 private:
  void read();
  int descriptor_;
  bool ended_ = false;
  std::string typed_;
};

}  // namespace knuckle::pairing
