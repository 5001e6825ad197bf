#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>

#include "app/battery/cell.h"
#include "app/battery/effects.h"
#include "app/battery/rows.h"
#include "app/battery/table.h"
#include "app/cli/command.h"
#include "app/cli/output_file.h"
#include "app/recordings/csv_row.h"
#include "app/report/plots.h"
#include "app/session/options.h"
#include "app/session/truth_file.h"
#include "app/studies/shared_battery.h"
#include "app/studies/sweep.h"
#include "core/error.h"
#include "machine/device_description.h"
#include "machine/load.h"

namespace knuckle::studies {
namespace {

using battery::Row;
using battery::Rows;
using battery::Settings;

Settings settings_of(const SweepOptions& o) {
  Settings settings = battery::load_settings(find_config("grid", o.grid.empty() ? o.battery : o.grid));
  if (battery::name(settings.kind) != o.battery)
    throw InputError(
        fmt::format("--grid {}: is of the battery {}, not {}", o.grid, battery::name(settings.kind), o.battery));
  if (o.machine) settings.machine = *o.machine;
  if (o.family) settings.family = *o.family;
  if (o.person) settings.person = *o.person;
  if (o.control) {
    if (!control_law_named(*o.control)) cli::refuse_option("--control", *o.control, kControlLawChoice);
    settings.control = *o.control;
  }
  if (o.seed && (*o.seed < 1 || *o.seed > battery::kMostSeed))
    cli::refuse_option(
        "--seed", std::to_string(*o.seed),
        fmt::format("must be a whole number from 1 to {} with --battery {}", battery::kMostSeed, o.battery));
  if (o.seed) settings.seed = *o.seed;
  if (o.sessions) settings.sessions = *o.sessions;
  (void)session::family_named(settings.family);
  (void)session::person_named(settings.person, sim::PersonClass::kExact);
  return settings;
}

nlohmann::ordered_json json_of(const Settings& settings, const Rows& rows, const std::vector<battery::Group>& groups) {
  nlohmann::ordered_json json{{"schema", battery::kResultSchema},
                              {"version", cli::program_version()},
                              {"settings", battery::settings_json(settings)}};
  json["groups"] = nlohmann::ordered_json::array();
  for (const battery::Group& group : groups) {
    nlohmann::ordered_json one{
        {"by", group.by}, {"value", group.value}, {"drawn", group.drawn}, {"refused", group.refused}};
    for (const battery::Figure& f : group.figures)
      one["figures"].push_back({{"name", f.name},
                                {"value", f.value ? nlohmann::ordered_json(*f.value) : nlohmann::ordered_json()},
                                {"of", f.of}});
    json["groups"].push_back(one);
  }
  json["sensitivity"] = nlohmann::ordered_json::array();
  for (const battery::Sensitivity& s : battery::sensitivities(rows))
    json["sensitivity"].push_back(
        {{"effect", s.effect}, {"metric", s.metric}, {"correlation", s.correlation}, {"of", s.of}});
  json["rows"] = nlohmann::ordered_json::array();
  for (const auto& [index, row] : rows) json["rows"].push_back(row);
  return json;
}

/// A column for everything drawn and every metric; empty where there is no value.
void write_csv(std::ostream& out, const Rows& rows) {
  if (rows.empty()) return;
  const auto line = [&out](const Row& row, const Row& like, bool names) {
    recordings::RowWriter cells(out, names);
    cells.word("cell", row["cell"].dump());
    for (const char* part : {"drawn", "metrics"}) {
      if (!like.contains(part)) continue;
      for (const auto& [name, unused] : like[part].items()) {
        const Row value = row.contains(part) && row[part].contains(name) ? row[part][name] : Row();
        cells.word(name, value.is_null() ? "" : value.is_string() ? value.get<std::string>() : value.dump());
      }
    }
    cells.word("refused", battery::was_run(row) ? "" : row["refused"].get<std::string>());
    cells.end_row();
  };
  const auto complete =
      std::find_if(rows.begin(), rows.end(), [](const auto& row) { return battery::was_run(row.second); });
  const Row& like = complete != rows.end() ? complete->second : rows.begin()->second;
  line(like, like, true);
  for (const auto& [index, row] : rows) line(row, like, false);
}

/// Of sessions; quantiles are named after their metric.
bool is_share(const battery::Figure& figure) {
  return figure.name.find('_') == std::string::npos;
}

void print(std::ostream& out, const Settings& settings, const Rows& rows, const std::vector<battery::Group>& groups) {
  out << fmt::format("{} of {} sessions of battery {}, machine {}, family {}, person {}, seed {}\n", rows.size(),
                     settings.sessions, battery::name(settings.kind), settings.machine, settings.family,
                     settings.person, settings.seed);
  const battery::Group& all = groups.front();
  out << fmt::format("\nall: {} sessions, {} refused\n", all.drawn, all.refused);
  for (const battery::Figure& f : all.figures) out << fmt::format("  {:28} {:>9}  of {}\n", f.name, f.text(), f.of);
  // The parts by their shares only: quantiles of a few sessions say little, and are in --json.
  const std::string* by = nullptr;
  for (std::size_t i = 1; i < groups.size(); ++i) {
    const battery::Group& group = groups[i];
    if (by == nullptr || *by != group.by) {
      out << fmt::format("\n{:28} sessions", group.by);
      for (const battery::Figure& f : group.figures) {
        if (is_share(f)) out << "  " << f.name;
      }
      out << '\n';
    }
    by = &group.by;
    out << fmt::format("  {:26} {:>8}", group.value, group.drawn);
    for (const battery::Figure& f : group.figures) {
      if (is_share(f)) out << fmt::format("  {:>{}}", f.text(), f.name.size());
    }
    out << '\n';
  }
}

/// Opened before anything runs, so that a bad place is known at once.
struct Outputs {
  explicit Outputs(const SweepOptions& o) : json("--json", o.json), csv("--csv", o.csv), report("--report", o.report) {
    if (report) report::check_gnuplot();
  }
  cli::OptionalOutput json, csv, report;
};

int finish(const SweepOptions& options, const Settings& settings, Outputs& outputs, const Rows& rows) {
  const std::vector<battery::Group> groups = battery::groups_of(rows, settings.kind);
  outputs.json.write([&](std::ostream& to) { to << json_of(settings, rows, groups).dump(1) << '\n'; });
  outputs.csv.write([&](std::ostream& to) { write_csv(to, rows); });
  outputs.report.write([&](std::ostream& to) { battery::write_page(to, settings, rows); });
  const bool to_standard_output = cli::is_standard_output(options.json) || cli::is_standard_output(options.csv) ||
                                  cli::is_standard_output(options.report);
  print(to_standard_output ? std::cerr : std::cout, settings, rows, groups);
  for (const auto& [index, row] : rows) {
    if (!battery::was_run(row)) std::cerr << fmt::format("cell {}: {}\n", index, row["refused"].get<std::string>());
  }
  return groups.front().refused == 0 ? 0 : 1;
}

}  // namespace

int run_session_sweep(const SweepOptions& o) {
  return run_shared(o, [&o](bool writes) {
    const auto settings = std::make_shared<const Settings>(settings_of(o));
    const auto outputs = std::make_shared<std::optional<Outputs>>();
    if (writes) outputs->emplace(o);
    const auto drawer = std::make_shared<std::optional<battery::Drawer>>();
    return SharedBattery{.title = o.battery,
                         .key = battery::rows_key(*settings),
                         .prepare = [=] { drawer->emplace(*settings); },
                         .run = [=](std::uint64_t cell) { return battery::run_cell(**drawer, cell); },
                         .finish = [=, &o](const Rows& rows) { return finish(o, *settings, **outputs, rows); }};
  });
}

}  // namespace knuckle::studies
