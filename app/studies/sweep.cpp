#include "app/studies/sweep.h"

#include <algorithm>
#include <cctype>
#include <memory>
#include <utility>

namespace knuckle::studies {
namespace {

constexpr const char* kEstimation = "estimation";

/// What only one kind of battery knows.
using Names = std::vector<const char*>;
const Names kOfEstimation{"--machines", "--ensemble", "--ablation", "--budget", "--running", "--contact-from-tip-m"};
const Names kOfSessions{"--grid", "--sessions", "--person", "--control", "--csv", "--report"};

void add_options(const cli::OptionList& c, SweepOptions& o) {
  c.add_option("--battery", o.battery, "Battery to run: feel, work or estimation")
      .required()
      .one_of({"feel", "work", kEstimation});
  c.add_option("--machine", o.machine, "Nominal machine that the machines are sampled around: name or .toml file");
  c.add_option("--family", o.family, "Machines to sample from: smooth, serviced or worn");
  c.add_option("--seed", o.seed, "Seed of what is sampled").check(cli::seed_error);
  c.add_option("--jobs", o.jobs, "Threads, up to 1024; 0: one per processor")
      .show_default()
      .check(cli::count_within(0, 1024));
  c.add_option("--json", o.json, "Write the result as JSON (docs/studies.md)");
  c.add_option("--shard", o.shard, "K/N: every N-th session (estimation: machine) from the K-th on");
  c.add_option("--rows", o.rows,
               "Keep the row of each session or machine in this file; what is there is not run again");
  c.add_option("--merge", o.merge, "Rows of other runs, such as other shards");

  c.add_option("--grid", o.grid, "feel, work: what to draw from: name or .toml file (default: the battery's own)");
  c.add_option("--sessions", o.sessions, "feel, work: number of sessions, 1 to 1000000, instead of the grid's")
      .check(cli::count_within(1, 1'000'000));
  c.add_option("--person", o.person, "feel, work: the operator: exact, steady or rough, instead of the grid's");
  c.add_option("--control", o.control, "feel, work: bilateral law: echo, cues or direct");
  c.add_option("--csv", o.csv, "feel, work: write the rows as CSV");
  c.add_option("--report", o.report, "feel, work: write a page with tables and maps");

  c.add_option("--machines", o.machines, "estimation: number of sampled machines, 1 to 100000")
      .show_default()
      .check(cli::count_within(1, 100'000));
  c.add_option("--ensemble", o.ensemble,
               "estimation: number of other machines to measure the model error on, 2 to 10000; 0: none")
      .show_default()
      .check(cli::ensemble_size_error);
  c.add_option("--ablation", o.ablation,
               "estimation: number of machines to test the method on with each part switched off in turn; 0: none")
      .show_default()
      .check(cli::count_within(0, 100'000));
  c.add_option("--budget", o.budget, "estimation: number of machines for each single source of error; 0: none")
      .show_default()
      .check(cli::count_within(0, 100'000));
  c.add_option("--running", o.running,
               "estimation: number of machines to pull at while they run, with each contact model in turn; 0: none")
      .show_default()
      .check(cli::count_within(0, 100'000));
  c.add_option("--contact-from-tip-m", o.from_tip_m,
               "estimation: where known forces act: this far from the bucket's tip towards its pin, 0 to its length")
      .show_default();
}

void refuse(const cli::OptionList& c, const Names& names, const std::string& battery) {
  for (const char* name : names) {
    if (c.given(name)) cli::refuse_option(name, "", "does not go with --battery " + battery);
  }
}

void check_places(const SweepOptions& o) {
  cli::Places places;
  places.configuration("--machine", o.machine.value_or(""));
  places.configuration("--grid", o.grid);
  for (const std::string& file : o.merge) {
    cli::check_readable("--merge", file);
    places.input("--merge", file);
  }
  places.output("--rows", o.rows);
  const std::pair<const char*, std::string> outputs[] = {{"--json", o.json}, {"--csv", o.csv}, {"--report", o.report}};
  for (const auto& [option, file] : outputs) {
    places.output(option, file);
    const auto is_digit = [](unsigned char c) { return std::isdigit(c) != 0; };
    const std::string folder_and_name = o.rows + '.';
    if (!o.rows.empty() && file.starts_with(folder_and_name) && file.size() > folder_and_name.size() &&
        std::all_of(file.begin() + std::ssize(folder_and_name), file.end(), is_digit))
      cli::refuse_option(option, file, "is kept for --rows of one of several processes");
  }
}

}  // namespace

cli::Command sweep_entry() {
  return {"sweep", "Evaluate Knuckle on many sampled machines and sessions", [](const cli::OptionList& command) {
            const auto options = std::make_shared<SweepOptions>();
            add_options(command, *options);
            return [command, options] {
              refuse(command, options->battery == kEstimation ? kOfSessions : kOfEstimation, options->battery);
              check_places(*options);
              return options->battery == kEstimation ? run_estimation_sweep(*options) : run_session_sweep(*options);
            };
          }};
}

}  // namespace knuckle::studies
