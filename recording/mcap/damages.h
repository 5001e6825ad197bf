// What is wrong with a file, in lines for people.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace knuckle::mcap {

class Damages {
 public:
  explicit Damages(std::string file) : file_(std::move(file)) {}
  [[nodiscard]] const std::string& file() const noexcept { return file_; }

  /// "FILE: WHAT at byte AT (WHEN): WHY"; once, however often it is met.
  void add(std::string_view what, std::uint64_t at, std::string_view why, std::string_view when = "");
  /// Of more than a hundred the last line says so.
  [[nodiscard]] const std::vector<std::string>& lines() const noexcept { return lines_; }

 private:
  std::string file_;
  std::vector<std::string> lines_;
};

}  // namespace knuckle::mcap
