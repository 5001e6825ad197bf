#include "app/session/link_file.h"

#include <fmt/format.h>

#include <utility>

#include "app/session/scenario.h"
#include "machine/toml_reader.h"

namespace knuckle::session {
namespace {

constexpr double kMilli = 1e-3, kLatest_s = 86400;
constexpr std::size_t kMostLinkEvents = 64;  // of each kind in a file

Duration milliseconds(TomlTable& table, const char* key, double min, double max) {
  return from_seconds(table.number(key, min, max, kMilli));
}
Time moment(TomlTable& table) {
  return Time(from_seconds(table.number("at_s", 0, kLatest_s)));
}
/// 0 where the key is absent.
double share(TomlTable& table, const char* key) {
  return table.has(key) ? table.number(key, 0, 1) : 0;
}

void read_shape(TomlTable& table, Duration& width, JitterShape& shape) {
  shape = static_cast<JitterShape>(table.choice("distribution", {"uniform", "normal", "pareto"}));
  if (!table.sound({"distribution"})) return table.leave_rest();
  const char* const key = shape == JitterShape::kUniform ? "half_width_ms" : "deviation_ms";
  width = milliseconds(table, key, 0, kLongestDelay_ms);
}

LinkImpairment::BurstLoss read_burst_loss(TomlTable table) {
  LinkImpairment::BurstLoss loss;
  loss.mean_good = from_seconds(table.number("mean_good_s", 1e-3, 3600));
  loss.mean_bad = milliseconds(table, "mean_bad_ms", 1, 60'000);
  loss.loss_in_good = share(table, "loss_in_good");
  loss.loss_in_bad = table.number("loss_in_bad", 0, 1);
  return loss;
}

void read_delays(TomlTable& table, LinkImpairment& link) {
  if (table.has("delay_ms")) link.delay = milliseconds(table, "delay_ms", 0, kLongestDelay_ms);
  if (table.has("jitter")) {
    TomlTable jitter = table.table("jitter");
    read_shape(jitter, link.jitter, link.jitter_shape);
  }
  if (table.has("slow_jitter")) {
    TomlTable jitter = table.table("slow_jitter");
    read_shape(jitter, link.slow_jitter, link.slow_jitter_shape);
    link.jitter_time = from_seconds(jitter.number("correlation_s", 0.001, 60));
  }
  // No delay is below 0: wider, and the mean would be above delay_ms.
  const auto half = [](Duration width, JitterShape shape) {
    return shape == JitterShape::kUniform ? width : Duration::zero();
  };
  const Duration widest = half(link.jitter, link.jitter_shape) + half(link.slow_jitter, link.slow_jitter_shape);
  table.require(
      link.delay >= widest, "delay_ms",
      fmt::format("must be at least the half widths of its uniform jitter ({:g} ms)", 1e3 * to_seconds(widest)),
      {"jitter", "slow_jitter"});
  if (table.has("in_order")) link.in_order = table.boolean("in_order");
  if (table.has("second_path_delay_ms"))
    link.second_path = milliseconds(table, "second_path_delay_ms", 0.001, kLongestDelay_ms);
}

/// What one direction is like, from the start or from a change on.
LinkImpairment read_conditions(TomlTable table) {
  LinkImpairment link;
  read_delays(table, link);
  link.loss = share(table, "loss");
  if (table.has("burst_loss")) link.burst_loss = read_burst_loss(table.table("burst_loss"));
  if (table.has("random_outages")) {
    TomlTable outages = table.table("random_outages");
    link.bursts_per_s = outages.number("per_s", 0, 10);
    link.burst_length = milliseconds(outages, "length_ms", 1, 60'000);
  }
  link.duplication = share(table, "duplication");
  link.reordering = share(table, "reordering");
  table.require(!link.in_order || link.reordering == 0, "reordering", "must be 0 where in_order is true", {"in_order"});
  if (link.duplication > 0 || link.reordering > 0)
    link.reorder_delay = milliseconds(table, "reorder_delay_ms", 0.001, kLongestDelay_ms);
  if (table.has("rate_limit")) {
    TomlTable limit = table.table("rate_limit");
    link.rate_Bps = limit.number("rate_kBps", 0.1, 1e6, 1e3);
    link.queue_B = static_cast<std::size_t>(limit.number("queue_kB", 1.5, 1e6, 1e3));
  }
  return link;
}

/// [both], or [to_machine] and [to_operator], one of which may be absent: it does nothing.
/// @param use called with each direction that is there. @return whether there is one.
template <typename Use>
bool read_directions(TomlTable& table, const Use& use) {
  const bool both = table.has("both");
  bool any = both;
  for (const char* one : {"to_machine", "to_operator"}) {
    if (!table.has(one)) continue;
    TomlTable direction = table.table(one);
    table.require(!both, one, "does not go with [both]: give [both] alone, or [to_machine] and [to_operator]");
    use(one, read_conditions(direction));
    any = true;
  }
  if (!both) return any;
  const LinkImpairment link = read_conditions(table.table("both"));
  use("to_machine", link);
  use("to_operator", link);
  return any;
}

class Reader {
 public:
  explicit Reader(TomlTable file) : file_(std::move(file)) {}

  LinkFile read() {
    link_.source = file_.source();
    link_.name = file_.text("name");
    link_.description = file_.text("description");
    (void)read_directions(file_, [this](const char* name, const LinkImpairment& given) { direction(name) = given; });
    read_changes();
    read_outages();
    read_address_changes();
    file_.finish();
    check(link_.to_machine);
    check(link_.to_operator);
    return link_;
  }

 private:
  LinkImpairment& direction(const std::string& name) {
    return name == "to_machine" ? link_.to_machine : link_.to_operator;
  }
  std::vector<TomlTable> events(const char* kind) {
    std::vector<TomlTable> tables = file_.tables(kind);
    file_.require(tables.size() <= kMostLinkEvents, kind, "must be at most " + std::to_string(kMostLinkEvents));
    return tables;
  }
  void read_changes() {
    for (TomlTable& table : events("change")) {
      const Time at = moment(table);
      const bool any = read_directions(table, [&](const char* name, LinkImpairment given) {
        auto& changes = direction(name).changes;
        table.require(changes.empty() || changes.back().at < at, "at_s", "must be above that of the change before");
        changes.push_back({at, std::move(given)});
      });
      table.require(any, "at_s",
                    "changes nothing: give [change.both], or [change.to_machine] and [change.to_operator]");
    }
  }
  void read_outages() {
    for (TomlTable& table : events("outage")) {
      LinkImpairment::Outage outage{moment(table), milliseconds(table, "length_ms", 1, 3.6e6)};
      if (table.has("every_s")) {
        outage.every = from_seconds(table.number("every_s", 0.01, kLatest_s));
        table.require(outage.every > outage.length, "every_s", "must be longer than the outage", {"length_ms"});
      }
      const int which = table.choice("direction", {"both", "to_machine", "to_operator"});
      if (which != 2) link_.to_machine.outages.push_back(outage);
      if (which != 1) link_.to_operator.outages.push_back(outage);
    }
  }
  void read_address_changes() {
    for (TomlTable& table : events("address_change")) {
      const Time at = moment(table);
      auto& times = table.choice("direction", {"to_machine", "to_operator"}) == 0 ? link_.to_machine.address_changes
                                                                                  : link_.to_operator.address_changes;
      table.require(times.empty() || times.back() < at, "at_s", "must be above that of the address change before");
      times.push_back(at);
    }
  }

  TomlTable file_;
  LinkFile link_;
};

}  // namespace

LinkFile load_link(const std::string& path) {
  return Reader(TomlTable::read_kind("link", path)).read();
}

LinkFile parse_link(std::string_view text, const std::string& source) {
  return Reader(TomlTable::parse(text, source)).read();
}

}  // namespace knuckle::session
