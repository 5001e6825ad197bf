#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/recordings/csv_reader.h"
#include "core/quantile.h"
#include "core/units.h"

namespace knuckle::recordings {
namespace {

struct Unit {
  const char* name;
  double si;
};
constexpr Unit kPressures[]{{"Pa", 1}, {"kPa", 1e3}, {"bar", 1e5}, {"MPa", 1e6}, {"psi", 6894.757293168}};
constexpr Unit kLengths[]{{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"inches", 0.0254}};
constexpr Unit kAngles[]{{"rad", 1}, {"deg", kDegree}};

/// What its channels are like.
struct Quantity {
  std::span<const Unit> units;
  double least, most;  ///< Of values that tell a unit, SI: smaller ones may be noise around zero.
  double apart;        ///< SI; two channels that are closer are not told from each other.
};
std::optional<Quantity> quantity_of(const std::string& channel) {
  if (channel.ends_with("_Pa")) return Quantity{kPressures, 5e5, 1e8, 5e5};
  if (channel.ends_with("_m")) return Quantity{kLengths, 0.05, 50, 0.005};
  if (channel.ends_with("_rad")) return Quantity{kAngles, 0.02, 2 * std::numbers::pi, 0.05};
  return std::nullopt;
}

/// The cells of one channel that can be used, as they stand in the file but for an offset.
struct Series {
  std::vector<double> cell;
  std::vector<std::size_t> index;  ///< In the table.
};
Series series_of(const MappedChannel& channel) {
  Series series;
  for (std::size_t i = 0; i < channel.values.size(); ++i) {
    if (!std::isfinite(channel.values[i])) continue;
    series.cell.push_back((channel.values[i] - channel.offset) / channel.factor);
    series.index.push_back(i);
  }
  return series;
}

/// Logarithm of a cell over the one before it; infinite where one is zero or their signs differ.
double log_step(const Series& series, std::size_t i) {
  const double ratio = series.cell[i] / series.cell[i - 1];
  return ratio > 0 ? std::log(ratio) : std::numeric_limits<double>::infinity();
}

/// Values around a jump, each way up to where another one is as large.
struct Around {
  std::vector<double> before, after;  ///< Absolute.
  double usual_step = 0;              ///< Median of the logarithms, absolute.
};
Around around(const Series& series, std::size_t at, std::size_t most) {
  const double large = 0.8 * std::abs(log_step(series, at));
  Around found;
  std::vector<double> steps;
  for (std::size_t i = at; i > 0 && found.before.size() < most; --i) {
    found.before.push_back(std::abs(series.cell[i - 1]));
    if (i < 2 || std::abs(log_step(series, i - 1)) > large) break;
    steps.push_back(std::abs(log_step(series, i - 1)));
  }
  for (std::size_t i = at; i < series.cell.size() && found.after.size() < most; ++i) {
    found.after.push_back(std::abs(series.cell[i]));
    if (i + 1 == series.cell.size() || std::abs(log_step(series, i + 1)) > large) break;
    steps.push_back(std::abs(log_step(series, i + 1)));
  }
  if (!steps.empty()) found.usual_step = median(steps);
  return found;
}

/// Pressures change tenfold within seconds, but by no thousand.
bool of_thousands(double log_ratio) {
  return std::abs(log_ratio) > std::log(500.0);
}

/// What a jump may be off the two units' ratio: pressures of thousands are noise otherwise.
double most_off(double log_ratio) {
  return of_thousands(log_ratio) ? 0.25 : 0.08;
}

/// @param log_ratio of the two units. Whether the jump is just this large, and what is before it nowhere as what is
/// behind it. @param most_off logarithm
bool jumps_by(const Series& series, std::size_t at, double log_ratio, double most_off) {
  constexpr std::size_t kLeast = 5;
  constexpr double kExact = 0.02, kSteps = 5;
  const bool thousands = of_thousands(log_ratio);
  const double off = std::abs(log_step(series, at) - log_ratio);
  if (off > most_off) return false;
  const Around values = around(series, at, thousands ? 200 : 40);
  if (values.before.size() < kLeast || values.after.size() < kLeast) return false;
  if (off > kExact + kSteps * values.usual_step) return false;
  const auto& large = log_ratio > 0 ? values.after : values.before;
  const auto& small = log_ratio > 0 ? values.before : values.after;
  return quantile(large, 0.1) > quantile(small, 0.9);
}

struct UnitJump {
  const MappedChannel* channel;
  std::size_t index;  ///< In the table.
  double log_ratio;   ///< Of cells, behind it over before it.
  double cell, before;
  std::string units;  ///< "MPa after bar"
  bool sure;  ///< Else a pressure near the tank's, whose noise is large: it only tells what another one tells, too.
};

/// All that look like a change of its unit.
std::vector<UnitJump> unit_jumps(const MappedChannel& channel, const Quantity& quantity) {
  std::vector<UnitJump> jumps;
  const Series series = series_of(channel);
  const double own = std::abs(channel.factor);
  const auto is_own = [&](const Unit& unit) { return std::abs(unit.si / own - 1) < 1e-6; };
  const auto said = std::find_if(quantity.units.begin(), quantity.units.end(), is_own);
  const bool pressure = quantity.units.data() == kPressures;
  const auto is_small = [&](double cell, double log_ratio) {
    return std::abs(cell) * own < (of_thousands(log_ratio) ? 0.1 * quantity.least : quantity.least);
  };
  const auto believable = [&](double cell, double log_ratio) {
    const bool least = std::abs(cell) * own >= 0.1 * quantity.least && (pressure || !is_small(cell, log_ratio));
    return least && std::abs(cell) * own <= quantity.most;
  };
  constexpr double kLeastJump = 1;  // no two units are closer
  constexpr double kNoise = 0.25;   // of two neighbouring pressures
  for (std::size_t i = 1; i < series.cell.size(); ++i) {
    if (!(std::abs(log_step(series, i)) > kLeastJump)) continue;
    for (const Unit& other : quantity.units) {
      if (is_own(other)) continue;
      const double log_ratio = std::log(own / other.si);  // from its own unit to the other one
      const double off = pressure ? kNoise : most_off(log_ratio);
      const bool to = believable(series.cell[i - 1], log_ratio) && jumps_by(series, i, log_ratio, off);
      const bool from = !to && believable(series.cell[i], log_ratio) && jumps_by(series, i, -log_ratio, off);
      if (!to && !from) continue;
      const bool sure = !is_small(to ? series.cell[i - 1] : series.cell[i], log_ratio) &&
                        jumps_by(series, i, to ? log_ratio : -log_ratio, most_off(log_ratio));
      const char* const own_name = said == quantity.units.end() ? "its own unit" : said->name;
      jumps.push_back({&channel, series.index[i], to ? log_ratio : -log_ratio, series.cell[i], series.cell[i - 1],
                       fmt::format("{} after {}", to ? other.name : own_name, to ? own_name : other.name), sure});
    }
  }
  return jumps;
}

[[noreturn]] void refuse_unit_change(const MappedTable& table, const UnitJump& jump) {
  table.refuse(fmt::format("column '{}' changes its unit: from row {} on it is {:.5g}, before it {:.5g}: {}",
                           jump.channel->column, table.rows[jump.index], jump.cell, jump.before, jump.units));
}

/// A logger that was set up anew writes its other pressures in the other unit, too.
void judge_pressure_jumps(MappedTable& table, const std::vector<UnitJump>& jumps) {
  std::map<std::size_t, std::vector<const UnitJump*>> at;
  for (const UnitJump& jump : jumps) at[jump.index].push_back(&jump);
  const MappedChannel* noted = nullptr;
  for (const UnitJump& jump : jumps) {
    if (!jump.sure) continue;
    const auto& same_row = at[jump.index];
    const auto likewise = [&](const UnitJump* other) {
      return other->channel != jump.channel && std::abs(other->log_ratio - jump.log_ratio) < 1e-6;
    };
    if (std::any_of(same_row.begin(), same_row.end(), likewise)) refuse_unit_change(table, jump);
    if (jump.channel == noted) continue;
    noted = jump.channel;
    table.notes.push_back(
        fmt::format("column '{}' jumps from {:.5g} to {:.5g} at row {} (as {}), no other one does: used",
                    jump.channel->column, jump.before, jump.cell, table.rows[jump.index], jump.units));
  }
}

/// Two channels of one quantity, row by row.
class Pair {
 public:
  Pair(const MappedChannel& a, const MappedChannel& b) {
    for (std::size_t i = 0; i < a.values.size(); ++i) {
      if (!std::isfinite(a.values[i]) || !std::isfinite(b.values[i])) continue;
      a_.push_back(a.values[i]);
      b_.push_back(b.values[i]);
      index_.push_back(i);
    }
  }
  /// The first place at which each goes on where the other one was; nothing where there is none.
  [[nodiscard]] std::optional<std::size_t> exchange(double apart) const {
    for (std::size_t i = 1; i < a_.size(); ++i) {
      const double straight = step(i);
      if (straight < 2 * apart || crossed(i) > straight / 4) continue;
      const double usual = largest_step_around(i);
      if (straight > 4 * usual && crossed(i) <= 1.5 * usual + 0.02 * straight) return i;
    }
    return std::nullopt;
  }
  [[nodiscard]] std::size_t index(std::size_t i) const { return index_[i]; }
  [[nodiscard]] double a(std::size_t i) const { return a_[i]; }
  [[nodiscard]] double b(std::size_t i) const { return b_[i]; }

 private:
  [[nodiscard]] double step(std::size_t i) const { return std::abs(a_[i] - a_[i - 1]) + std::abs(b_[i] - b_[i - 1]); }
  [[nodiscard]] double crossed(std::size_t i) const {
    return std::abs(a_[i] - b_[i - 1]) + std::abs(b_[i] - a_[i - 1]);
  }
  [[nodiscard]] double largest_step_around(std::size_t at) const {
    constexpr std::size_t kRows = 10;
    const std::size_t first = at > kRows ? at - kRows : 1, last = std::min(at + kRows, a_.size() - 1);
    if (last - first < kRows) return std::numeric_limits<double>::infinity();  // too little to tell
    double largest = 0;
    for (std::size_t i = first; i <= last; ++i) largest = i == at ? largest : std::max(largest, step(i));
    return largest;
  }

  std::vector<double> a_, b_;
  std::vector<std::size_t> index_;
};

void refuse_exchange(const MappedTable& table, const MappedChannel& a, const MappedChannel& b, double apart) {
  const Pair pair(a, b);
  const auto at = pair.exchange(apart);
  if (!at) return;
  table.refuse(
      fmt::format("columns '{}' and '{}' exchange their values: {:.5g} and {:.5g} until row {}, {:.5g} and {:.5g} "
                  "(SI) from row {} on",
                  a.column, b.column, pair.a(*at - 1), pair.b(*at - 1), table.rows[pair.index(*at - 1)], pair.a(*at),
                  pair.b(*at), table.rows[pair.index(*at)]));
}

}  // namespace

void refuse_halfway_changes(MappedTable& table) {
  std::vector<UnitJump> of_pressures;
  for (const MappedChannel& channel : table.channels) {
    const auto quantity = quantity_of(channel.name);
    if (!quantity) continue;
    for (UnitJump& jump : unit_jumps(channel, *quantity)) {
      const bool pressure = quantity->units.data() == kPressures;
      if (!pressure || of_thousands(jump.log_ratio)) refuse_unit_change(table, jump);
      of_pressures.push_back(std::move(jump));
    }
  }
  judge_pressure_jumps(table, of_pressures);
  for (auto a = table.channels.begin(); a != table.channels.end(); ++a) {
    const auto quantity = quantity_of(a->name);
    if (!quantity) continue;
    for (auto b = a + 1; b != table.channels.end(); ++b) {
      const auto other = quantity_of(b->name);
      if (other && other->units.data() == quantity->units.data()) refuse_exchange(table, *a, *b, quantity->apart);
    }
  }
}

}  // namespace knuckle::recordings
