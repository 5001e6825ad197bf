#include "app/battery/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "core/quantile.h"

namespace knuckle::battery {
namespace {

using Members = std::vector<const Row*>;

struct Quantile {
  const char* metric;
  const char* suffix;
  double share;
};
constexpr Quantile kQuantiles[] = {{"felt_error_rel", "median", 0.5},   {"felt_error_rel", "p95", 0.95},
                                   {"felt_error_worst_N", "p95", 0.95}, {"felt_onset_ms", "median", 0.5},
                                   {"hold_error_N", "median", 0.5},     {"hold_error_N", "p95", 0.95},
                                   {"contact_swing_N", "p95", 0.95},    {"hold_true_swing_share", "median", 0.5},
                                   {"rise_t90_s", "median", 0.5},       {"rise_t90_s", "p95", 0.95},
                                   {"peak_over_asked", "median", 0.5},  {"peak_over_asked", "p90", 0.9},
                                   {"max_slew_N_per_ms", "p95", 0.95},  {"net_energy_J", "p95", 0.95},
                                   {"free_felt_peak_N", "p95", 0.95}};

Figure share_of(const char* name, const Members& members, bool (*is)(const Row&)) {
  const auto count = std::count_if(members.begin(), members.end(), [&](const Row* row) { return is(*row); });
  Figure figure{name, std::nullopt, members.size()};
  if (!members.empty()) figure.value = static_cast<double>(count) / static_cast<double>(members.size());
  return figure;
}

Figure quantile_of(const Quantile& asked, const Members& members) {
  std::vector<double> values;
  for (const Row* row : members) {
    if (const auto value = metric_of(*row, asked.metric)) values.push_back(*value);
  }
  Figure figure{fmt::format("{} {}", asked.metric, asked.suffix), std::nullopt, values.size()};
  if (!values.empty()) figure.value = quantile(values, asked.share);
  return figure;
}

Group group_of(std::string by, std::string value, const Members& all, Kind kind) {
  Group group{std::move(by), std::move(value), all.size(), 0, {}};
  Members members;
  for (const Row* row : all) {
    if (was_run(*row)) members.push_back(row);
  }
  group.refused = all.size() - members.size();
  group.figures.push_back(share_of("passed", members, passed));
  if (kind == Kind::kFeel) {
    group.figures.push_back(share_of("steady in the hand", members, steady_in_the_hand));
    group.figures.push_back(share_of("stable", members, stable));
    group.figures.push_back(share_of("stable and right", members, stable_and_right));
  }
  Members touched;
  for (const Row* row : members) {
    if (metric_of(*row, "unfelt_s")) touched.push_back(row);
  }
  group.figures.push_back(share_of("nothing unfelt", touched, nothing_unfelt));
  for (const Quantile& asked : kQuantiles) group.figures.push_back(quantile_of(asked, members));
  return group;
}

/// Where a session belongs by one of its columns; sorts as it should read.
using Key = std::pair<double, std::string>;
Key class_of(const Row& row, const std::string& column, bool by_decade) {
  const auto& value = row["drawn"][column];
  if (value.is_string()) return {0, value.get<std::string>()};
  const double number = value.get<double>();
  if (!by_decade) return {number, fmt::format("{:g}", number)};
  const double decade = std::floor(2 * std::log10(number)) / 2;  // halves of one
  return {decade, fmt::format("{:.2g} to {:.2g}", std::pow(10, decade), std::pow(10, decade + 0.5))};
}

bool meets(const Row& row, std::initializer_list<const char*> criteria) {
  const auto failed = [&row](const char* criterion) {
    return std::find(row["failed"].begin(), row["failed"].end(), criterion) != row["failed"].end();
  };
  return was_run(row) && std::none_of(criteria.begin(), criteria.end(), failed);
}

}  // namespace

const Figure& Group::figure(const std::string& name) const {
  const auto found = std::find_if(figures.begin(), figures.end(), [&](const Figure& f) { return f.name == name; });
  if (found == figures.end()) throw std::out_of_range("no figure " + name);
  return *found;
}

bool steady_in_the_hand(const Row& row) {
  return meets(row, {"faults", "phases_timed_out", "contact_losses", "hold_peak_to_peak_N"});
}

bool stable(const Row& row) {
  return steady_in_the_hand(row) && meets(row, {"hold_true_swing_share"});
}

bool stable_and_right(const Row& row) {
  return stable(row) && meets(row, {"hold_error_share"});
}

bool nothing_unfelt(const Row& row) {
  const auto unfelt_s = metric_of(row, "unfelt_s");
  return unfelt_s && *unfelt_s == 0;
}

std::vector<Group> groups_of(const Rows& rows, Kind kind) {
  Members all;
  for (const auto& [index, row] : rows) all.push_back(&row);
  std::vector<Group> groups{group_of("all", "", all, kind)};
  using Column = std::pair<const char*, bool>;
  const std::vector<Column> columns =
      kind == Kind::kFeel
          ? std::vector<Column>{{"rtt_ms", false},           {"limb", false},     {"place", false}, {"part", false},
                                {"stiffness_N_per_m", true}, {"speed_mps", true}, {"loss", false}}
          : std::vector<Column>{{"scenario", false}, {"rtt_ms", false}, {"limb", false}, {"loss", false}};
  for (const auto& [column, by_decade] : columns) {
    std::map<Key, Members> classes;
    for (const Row* row : all) {
      if ((*row)["drawn"].contains(column)) classes[class_of(*row, column, by_decade)].push_back(row);
    }
    for (const auto& [key, members] : classes) groups.push_back(group_of(column, key.second, members, kind));
  }
  return groups;
}

}  // namespace knuckle::battery
