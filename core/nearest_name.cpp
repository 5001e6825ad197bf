#include "core/nearest_name.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace knuckle {
namespace {

/// Edits (insert, delete, replace, swap neighbours) that turn `a` into `b`.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    now[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        now[j] = std::min(now[j], before[j - 2] + 1);
      }
    }
    before.swap(last);
    last.swap(now);
  }
  return last[b.size()];
}

}  // namespace

std::optional<std::string> nearest_name(std::string_view name, std::span<const std::string> names,
                                        std::size_t furthest) {
  std::optional<std::string> best;
  for (const std::string& one : names) {
    const std::size_t longer = std::max(name.size(), one.size()) - std::min(name.size(), one.size());
    if (longer > furthest) continue;  // so many edits at least
    const std::size_t distance = edit_distance(name, one);
    if (distance <= furthest) {
      furthest = distance == 0 ? 0 : distance - 1;
      best = one;
    }
  }
  return best;
}

std::optional<std::string> nearest_name(std::string_view name, std::span<const std::string> names) {
  return nearest_name(name, names, std::max<std::size_t>(2, 2 * name.size() / 5));
}

}  // namespace knuckle
