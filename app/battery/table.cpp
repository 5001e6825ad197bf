#include "app/battery/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "app/battery/effects.h"
#include "app/battery/quantity.h"
#include "app/report/html.h"
#include "app/report/plots.h"
#include "app/report/result_text.h"
#include "core/quantile.h"

namespace knuckle::battery {
namespace {

using Members = std::vector<const Row*>;

constexpr std::pair<const char*, By> kQuantiles[] = {
    {"felt_error_rel", By::kMedian},  {"felt_error_rel", By::kP95},
    {"felt_error_worst_N", By::kP95}, {"felt_onset_ms", By::kMedian},
    {"hold_error_N", By::kMedian},    {"hold_error_N", By::kP95},
    {"contact_swing_N", By::kP95},    {"hold_true_swing_share", By::kMedian},
    {"rise_t90_s", By::kMedian},      {"rise_t90_s", By::kP95},
    {"peak_over_asked", By::kMedian}, {"peak_over_asked", By::kP90},
    {"max_slew_N_per_ms", By::kP95},  {"net_energy_J", By::kP95},
    {"free_felt_peak_N", By::kP95}};

Figure share_of(const char* name, const Members& members, bool (*is)(const Row&)) {
  const auto count = std::count_if(members.begin(), members.end(), [&](const Row* row) { return is(*row); });
  Figure figure{name, std::nullopt, members.size()};
  if (!members.empty()) figure.value = static_cast<double>(count) / static_cast<double>(members.size());
  return figure;
}

Figure quantile_of(const char* metric, By by, const Sources& sources) {
  const Quantity quantity{fmt::format("{} {}", metric, name(by)), metric, by, ""};
  const std::vector<double> values = values_of(quantity, sources);
  const auto unknown = std::count_if(values.begin(), values.end(), [](double value) { return std::isnan(value); });
  Figure figure{quantity.name, std::nullopt, values.size() - static_cast<std::size_t>(unknown)};
  if (figure.of > 0) figure.value = value_of(quantity, sources);
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
  Sources metrics;
  for (const Row* row : members) metrics.push_back(&(*row)["metrics"]);
  for (const auto& [metric, share] : kQuantiles) group.figures.push_back(quantile_of(metric, share, metrics));
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

std::string Figure::text() const {
  return value ? report::number_text(*value) : "none";
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

namespace {

using report::escaped;

/// Sessions by two columns, for a map.
struct Map {
  std::vector<std::string> across, up;  ///< Labels.
  std::map<std::pair<std::size_t, std::size_t>, Members> cells;
};

constexpr double kFirstDecade = 4, kHalves = 0.5;  // of stiffness: 1e4 N/m on, by half decades

Map map_of(const Rows& rows, const std::string& up) {
  Map map;
  std::set<double> rtts;
  std::set<std::string> names;
  std::set<int> decades;
  const auto half = [](const Row& row) {
    return static_cast<int>(
        std::floor((std::log10(row["drawn"]["stiffness_N_per_m"].get<double>()) - kFirstDecade) / kHalves));
  };
  const bool by_stiffness = up == "stiffness_N_per_m";
  for (const auto& [index, row] : rows) {
    if (!was_run(row)) continue;
    rtts.insert(row["drawn"]["rtt_ms"].get<double>());
    if (by_stiffness)
      decades.insert(half(row));
    else
      names.insert(row["drawn"][up].get<std::string>());
  }
  for (const double rtt : rtts) map.across.push_back(fmt::format("{:g}", rtt));
  for (const int n : decades)
    map.up.push_back(report::number_text(1e-6 * std::pow(10, kFirstDecade + kHalves * (n + 0.5)), 2));
  for (const std::string& name : names) map.up.push_back(name);
  for (const auto& [index, row] : rows) {
    if (!was_run(row)) continue;
    const auto x = std::distance(rtts.begin(), rtts.find(row["drawn"]["rtt_ms"].get<double>()));
    const auto y = by_stiffness ? std::distance(decades.begin(), decades.find(half(row)))
                                : std::distance(names.begin(), names.find(row["drawn"][up].get<std::string>()));
    map.cells[{static_cast<std::size_t>(x), static_cast<std::size_t>(y)}].push_back(&row);
  }
  return map;
}

double median_in(const Members& rows, const char* metric) {
  std::vector<double> values;
  for (const Row* row : rows) {
    if (const auto value = metric_of(*row, metric)) values.push_back(*value);
  }
  return median(values);
}

/// A figure of coloured cells with their values; grey where there is none.
report::Figure heat_map(const Map& map, const std::string& up_label, double worst, double best,
                        const std::function<double(const Members&)>& value) {
  std::ostringstream script;
  script << report::plot_style() << "unset grid\nset style fill solid\n"
         << fmt::format("set palette defined (0 '#D55E00', 0.5 '#F0E442', 1 '#009E73')\nset cbrange [{}:{}]\n",
                        std::min(worst, best), std::max(worst, best));
  if (worst > best) script << "set palette negative\n";
  script << "set xlabel 'round trip, ms'\nset ylabel " << report::plot_quoted(up_label) << "\nset xtics (";
  for (std::size_t i = 0; i < map.across.size(); ++i) script << (i ? ", " : "") << "'" << map.across[i] << "' " << i;
  script << ")\nset ytics (";
  for (std::size_t i = 0; i < map.up.size(); ++i)
    script << (i ? ", " : "") << report::plot_quoted(map.up[i]) << ' ' << i;
  script << fmt::format(")\nset xrange [-0.5:{}]\nset yrange [-0.5:{}]\n", static_cast<double>(map.across.size()) - 0.5,
                        static_cast<double>(map.up.size()) - 0.5);
  script << "$cells << EOD\n";
  for (std::size_t y = 0; y < map.up.size(); ++y) {
    for (std::size_t x = 0; x < map.across.size(); ++x) {
      const auto found = map.cells.find({x, y});
      const double v = found == map.cells.end() ? std::numeric_limits<double>::quiet_NaN() : value(found->second);
      script << fmt::format("{} {} {} {}\n", x, y, std::isnan(v) ? "NaN" : fmt::format("{:.4g}", v),
                            std::isnan(v) ? "" : fmt::format("\"{:.2f}\"", v));
    }
  }
  script << "EOD\nplot $cells using 1:2:3 with image pixels notitle, $cells using 1:2:4 with labels notitle\n";
  return {700, 120 + 40 * static_cast<int>(map.up.size()), script.str()};
}

void write_table(std::ostream& out, const std::vector<Group>& groups) {
  out << "<section><h2>Table</h2><table><thead><tr><th>by</th><th></th><th>sessions</th><th>refused</th>";
  for (const Figure& figure : groups.front().figures) out << "<th>" << escaped(figure.name) << "</th>";
  out << "</tr></thead><tbody>\n";
  for (const Group& group : groups) {
    out << "<tr><td>" << escaped(group.by) << "</td><td>" << escaped(group.value) << "</td><td>" << group.drawn
        << "</td><td>" << group.refused << "</td>";
    for (const Figure& figure : group.figures) out << "<td>" << figure.text() << "</td>";
    out << "</tr>\n";
  }
  out << "</tbody></table></section>\n";
}

std::vector<report::PageFigure> maps_of(const Rows& rows) {
  const Map by_stiffness = map_of(rows, "stiffness_N_per_m"), by_limb = map_of(rows, "limb");
  const auto stable_share = [](const Members& cell) { return *share_of("", cell, stable).value; };
  const auto told_share = [](const Members& cell) { return *share_of("", cell, nothing_unfelt).value; };
  return {
      {"Stable: delay and stiffness", "Share of sessions whose press was stable; the boundary is the Z-width.",
       heat_map(by_stiffness, "stiffness of the wall, MN/m", 0, 1, stable_share)},
      {"Stable: delay and limb", "Share of sessions whose press was stable.",
       heat_map(by_limb, "limb", 0, 1, stable_share)},
      {"Nothing unfelt: delay and stiffness",
       "Share of sessions in which the true force was never above the felt one by 2 N for 0.3 s.",
       heat_map(by_stiffness, "stiffness of the wall, MN/m", 0, 1, told_share)},
      {"Transparency", "Felt against scaled true force over the whole session, RMS over RMS, median; 0 is the truth.",
       heat_map(by_stiffness, "stiffness of the wall, MN/m", 1, 0,
                [](const auto& cell) { return median_in(cell, "felt_error_rel"); })},
      {"Energy", "Net energy that the device gave to the hand, median [J].",
       heat_map(by_limb, "limb", 1, -1, [](const auto& cell) { return median_in(cell, "net_energy_J"); })}};
}

void write_sensitivities(std::ostream& out, const Rows& rows) {
  std::vector<Sensitivity> all = sensitivities(rows);
  if (all.empty()) return;
  std::erase_if(all, [](const Sensitivity& s) { return !s.is_plain(); });
  out << "<section><h2>Sensitivity</h2><p>Which property of the machine goes with which result: Spearman's rank "
         "correlation, the largest first; those that chance may have made are left "
         "out.</p><table><thead><tr><th>effect</th><th>metric</th><th>correlation</th>"
         "<th>sessions</th></tr></thead><tbody>\n";
  for (const Sensitivity& s : all)
    out << fmt::format("<tr><td>{}</td><td>{}</td><td>{:.2f}</td><td>{}</td></tr>\n", escaped(s.effect),
                       escaped(s.metric), s.correlation, s.of);
  out << "</tbody></table></section>\n";
}

}  // namespace

void write_page(std::ostream& out, const Settings& settings, const Rows& rows) {
  const std::string title =
      fmt::format("Battery {}: {} sessions of machine {}, family {}, person {}", name(settings.kind), rows.size(),
                  settings.machine, settings.family, settings.person);
  report::write_page_head(out, title, "table{font-size:.8em} td,th{padding:.1em .4em;text-align:right}");
  out << "<h1>" << escaped(title) << "</h1>\n";
  write_table(out, groups_of(rows, settings.kind));
  write_sensitivities(out, rows);
  if (settings.kind == Kind::kFeel && !rows.empty()) report::write_figures(out, maps_of(rows));
  report::write_page_end(out);
}

}  // namespace knuckle::battery
