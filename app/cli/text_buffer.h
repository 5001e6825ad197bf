// A stream buffer that gathers text and passes it on in large parts: at a flush, or once there is much of it.
#pragma once

#include <cstddef>
#include <functional>
#include <streambuf>
#include <string>
#include <string_view>
#include <utility>

namespace knuckle::cli {

class TextBuffer : public std::streambuf {
 public:
  /// @param pass_on gets whole lines, unless a flush comes in the middle of one. False: it could not be passed on, and
  /// the stream is bad from then on.
  explicit TextBuffer(std::function<bool(std::string_view)> pass_on) : pass_on_(std::move(pass_on)) {}

 protected:
  int_type overflow(int_type c) override {
    if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
    text_ += traits_type::to_char_type(c);
    return pass_lines() ? c : traits_type::eof();
  }
  std::streamsize xsputn(const char* data, std::streamsize size) override {
    text_.append(data, static_cast<std::size_t>(size));
    return pass_lines() ? size : 0;
  }
  int sync() override { return pass(text_.size()) ? 0 : -1; }

 private:
  static constexpr std::size_t kMuch = 1 << 16;

  bool pass_lines() {
    if (text_.size() < kMuch) return true;
    const auto end = text_.rfind('\n');
    return pass(end == std::string::npos ? text_.size() : end + 1);
  }
  bool pass(std::size_t size) {
    if (size == 0) return true;
    const bool passed = pass_on_(std::string_view(text_).substr(0, size));
    text_.erase(0, size);
    return passed;
  }

  std::function<bool(std::string_view)> pass_on_;
  std::string text_;
};

}  // namespace knuckle::cli
