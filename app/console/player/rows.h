// Finding in rows that are in the order of their times.
#pragma once

#include <algorithm>
#include <iterator>
#include <optional>
#include <vector>

#include "core/time.h"

namespace knuckle::console::player {

/// The first one that is later.
template <typename Row>
auto first_after(const std::vector<Row>& rows, Time at) noexcept {
  return std::upper_bound(rows.begin(), rows.end(), at, [](Time t, const Row& row) { return t < row.at; });
}
/// The first one that is not earlier.
template <typename Row>
auto first_from(const std::vector<Row>& rows, Time at) noexcept {
  return std::lower_bound(rows.begin(), rows.end(), at, [](const Row& row, Time t) { return row.at < t; });
}
/// The last one that is not later; nullptr: there is none.
template <typename Row>
const Row* newest(const std::vector<Row>& rows, Time at) noexcept {
  const auto later = first_after(rows, at);
  return later == rows.begin() ? nullptr : &*std::prev(later);
}
template <typename Row>
std::optional<Time> after(const std::vector<Row>& rows, Time at) noexcept {
  const auto later = first_after(rows, at);
  return later == rows.end() ? std::nullopt : std::optional(later->at);
}
template <typename Row>
std::optional<Time> before(const std::vector<Row>& rows, Time at) noexcept {
  const auto not_before = first_from(rows, at);
  return not_before == rows.begin() ? std::nullopt : std::optional(std::prev(not_before)->at);
}

}  // namespace knuckle::console::player
