#include "recording/mcap/damages.h"

#include <fmt/format.h>

#include <algorithm>

namespace knuckle::mcap {

void Damages::add(std::string_view what, std::uint64_t at, std::string_view why, std::string_view when) {
  constexpr std::size_t kMostLines = 100;
  if (lines_.size() > kMostLines) return;
  const std::string in_brackets = when.empty() ? "" : fmt::format(" ({})", when);
  std::string line = fmt::format("{}: {} at byte {}{}: {}", file_, what, at, in_brackets, why);
  if (std::find(lines_.begin(), lines_.end(), line) != lines_.end()) return;
  if (lines_.size() == kMostLines) line = fmt::format("{}: more is damaged than these {} places", file_, kMostLines);
  lines_.push_back(std::move(line));
}

}  // namespace knuckle::mcap
