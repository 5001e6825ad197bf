// Rows of CSV, header and values through the same calls, so that they cannot disagree.
#pragma once

#include <array>
#include <charconv>
#include <ostream>
#include <string>
#include <string_view>

namespace knuckle::recordings {

/// Writes rows as names or as values. Buffered: all is out when it is gone.
class RowWriter {
 public:
  /// @param line_end "\r\n" for files that shall obey RFC 4180 to the letter.
  RowWriter(std::ostream& out, bool names, std::string_view line_end = "\n")
      : out_(out), names_(names), line_end_(line_end) {}
  ~RowWriter() { flush(); }
  RowWriter(const RowWriter&) = delete;
  RowWriter& operator=(const RowWriter&) = delete;

  void number(std::string_view name, double value) {
    if (names_) return cell(name);
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, 10);
    cell({digits.data(), end.ptr});
  }
  /// With as many digits as it takes to read the same number again.
  template <typename Number>
  void exact(std::string_view name, Number value) {
    if (names_) return cell(name);
    std::array<char, 32> digits;
    cell({digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr});
  }
  /// Quoted where it has to be.
  void word(std::string_view name, std::string_view value) {
    const std::string_view shown = names_ ? name : value;
    if (shown.find_first_of(",\"\r\n") == std::string_view::npos) return cell(shown);
    std::string quoted = "\"";
    for (const char c : shown) quoted.append(c == '"' ? 2 : 1, c);
    cell(quoted + '"');
  }
  void end_row() {
    text_ += line_end_;
    row_is_empty_ = true;
    if (text_.size() >= kFlushBytes) flush();
  }
  void flush() {
    out_.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    text_.clear();
  }

 private:
  static constexpr std::size_t kFlushBytes = 1 << 16;

  void cell(std::string_view value) {
    if (!row_is_empty_) text_ += ',';
    row_is_empty_ = false;
    text_.append(value);
  }

  std::ostream& out_;
  bool names_, row_is_empty_ = true;
  std::string_view line_end_;
  std::string text_;
};

}  // namespace knuckle::recordings
