// The words, numbers and quoted texts of a DBC file, one after the other.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace knuckle::eds {

/// The whole text as a number of this type.
template <typename Number>
[[nodiscard]] std::optional<Number> number_in(std::string_view text) noexcept {
  if (text.starts_with('+')) text.remove_prefix(1);
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Goes forward through a text whose lines end with '\n', and knows in which it is. Blanks and line ends in front of
/// what is asked for are passed over.
class DbcText {
 public:
  explicit DbcText(std::string_view text) noexcept : text_(text) {}

  [[nodiscard]] int line() const noexcept { return line_; }
  bool done() noexcept {
    while (!text_.empty() && std::string_view(" \t\n").find(text_.front()) != std::string_view::npos)
      begins_line_ |= pass(1) == "\n";
    return text_.empty();
  }
  /// Whether what is next is the first of its line.
  bool begins_line() noexcept { return !done() && begins_line_; }
  bool at(char c) noexcept { return !done() && text_.front() == c; }
  bool accept(char c) noexcept {
    const bool is = at(c);
    if (is) take(1);
    return is;
  }
  /// Empty where something else is next, or nothing.
  std::string_view peek_word() noexcept {
    (void)done();
    return text_.substr(0, text_.find_first_of(" \t\n:;|@()[],\""));
  }
  std::string_view word() noexcept { return take(peek_word().size()); }
  /// Whether a word is next, and nothing behind it in its line.
  bool word_is_alone() noexcept {
    const std::size_t size = peek_word().size(), next = text_.find_first_not_of(" \t", size);
    return size > 0 && (next == std::string_view::npos || text_[next] == '\n');
  }
  std::string_view rest_of_line() noexcept { return take(text_.find('\n')); }
  /// What is in quotes; nothing where there are none, or no closing one (in this line). \" and \\ are the characters.
  std::optional<std::string> quoted(bool of_several_lines) {
    if (!accept('"')) return std::nullopt;
    std::string all;
    for (; !text_.empty() && (of_several_lines || text_.front() != '\n'); all += take(1)) {
      if (text_.front() == '"') {
        take(1);
        return all;
      }
      if (text_.starts_with("\\\"") || text_.starts_with("\\\\")) take(1);
    }
    return std::nullopt;
  }
  std::string_view take(std::size_t size) noexcept {
    begins_line_ &= size == 0;
    return pass(size);
  }

 private:
  std::string_view pass(std::size_t size) noexcept {
    const std::string_view taken = text_.substr(0, size);
    line_ += static_cast<int>(std::count(taken.begin(), taken.end(), '\n'));
    text_.remove_prefix(taken.size());
    return taken;
  }

  std::string_view text_;
  int line_ = 1;
  bool begins_line_ = true;
};

}  // namespace knuckle::eds
