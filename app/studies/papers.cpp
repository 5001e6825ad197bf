#include "app/studies/papers.h"

#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <stdexcept>

#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "app/cli/terminal.h"
#include "app/identify/baseline_report.h"
#include "app/report/plots.h"
#include "app/session/truth_file.h"
#include "machine/load.h"

namespace knuckle::studies {
namespace {

using identify::Identified;
using identify::Paper;

/// A method that found no parameters has nothing to show.
void require_result(const Identified& result, Paper experiment) {
  if (result.summary.covariance.size() > 0) return;
  throw std::runtime_error(fmt::format("experiment {}, {}: {}", identify::name(experiment),
                                       result.method == "full" ? "default method" : "their method",
                                       result.summary.reasons.front()));
}

Experiment repeated(Paper paper, identify::IdentifyOptions options, const std::function<void(double)>& progress) {
  constexpr double kDriving = 0.6;  // of the time
  options.method = identify::name(paper);
  Experiment experiment;
  experiment.data = identify::drive_for_data(options, [&](double done) { progress(kDriving * done); });
  experiment.theirs = identify::identify(experiment.data, paper);
  require_result(experiment.theirs, paper);
  if (paper == Paper::kStatic) return experiment;
  experiment.ours = identify::identify(experiment.data, std::nullopt, {},
                                       [&](double done) { progress(kDriving + (1 - kDriving) * done); });
  require_result(experiment.ours, paper);
  return experiment;
}

/// Not repeated: the machine did not engage or dropped out, its recordings were refused, or nothing was found in them.
template <typename Experiments, typename Repeat>
Repeated<Experiments> attempted(Paper paper, const MachineDescription& machine, const Repeat& repeat) {
  Repeated<Experiments> attempt;
  attempt.lacks = identify::missing_for(paper, machine);
  if (!attempt.lacks.empty()) {
    attempt.why_not = fmt::format(
        "experiment {}: needs {}; nobody measures those of the {} (sensors.without_pressures)", identify::name(paper),
        attempt.lacks, kJointNames[static_cast<std::size_t>(machine.sensors.without_pressures)]);
    return attempt;
  }
  try {
    attempt.done = repeat();
  } catch (const std::runtime_error& stopped) {
    attempt.why_not = stopped.what();
  }
  return attempt;
}

struct Options {
  std::string machine = "solar015", family, report;
  std::uint64_t seed = 1;
};

void add_options(const cli::OptionList& command, Options& o) {
  command.add_option("--machine", o.machine, "Machine that is simulated: name or .toml file").show_default();
  command.add_option("--family", o.family, "Machines to sample from: smooth (default), serviced or worn");
  command.add_option("--seed", o.seed, "Seed of the sampled machine").show_default().check(cli::seed_error);
  command.add_option("--report", o.report, "Write the page here (.html)").required();
}

int run(const Options& o, const std::string& command_line) {
  cli::Places places;
  places.configuration("--machine", o.machine);
  places.output("--report", o.report);
  identify::IdentifyOptions options;
  options.machine = o.machine;
  options.family = o.family;
  options.seed = o.seed;
  const cli::InterruptGuard interrupt;
  report::check_gnuplot();
  cli::OutputFile page("--report", o.report);
  const RepeatedPapers papers =
      cli::watched(interrupt, "papers", [&](const auto& progress) { return repeat_papers(options, progress); });
  write_papers_page(papers, {command_line, cli::now_utc()}, page.stream());
  page.commit();
  if (!cli::is_standard_output(o.report)) std::cout << "written: " << o.report << '\n';
  for (const std::string& why : {papers.malaguti.why_not, papers.kim.why_not}) {
    if (!why.empty()) std::cerr << "knuckle-studies papers: not repeated: " << why << '\n';
  }
  return papers.complete() ? 0 : 1;
}

}  // namespace

RepeatedPapers repeat_papers(const identify::IdentifyOptions& options, const std::function<void(double)>& progress) {
  const auto part = [&](double from, double share) { return [=](double done) { progress(from + share * done); }; };
  // Before anything is driven: what is refused from here on is the machine's recordings.
  const MachineDescription machine = load_machine(find_config("machine", options.machine));
  (void)session::family_named(options.family);
  RepeatedPapers papers;
  papers.machine =
      fmt::format("{}, {}, seed {}", machine.name, options.family.empty() ? "smooth" : options.family, options.seed);
  papers.malaguti = attempted<MalagutiRepeated>(Paper::kMalaguti, machine, [&] {
    MalagutiRepeated both{repeated(Paper::kStatic, options, part(0, 0.4)),
                          repeated(Paper::kMalaguti, options, part(0.4, 0.3))};
    both.poses.ours = both.digging.ours;
    return both;
  });
  papers.kim =
      attempted<Experiment>(Paper::kKim, machine, [&] { return repeated(Paper::kKim, options, part(0.7, 0.3)); });
  return papers;
}

cli::Command papers_entry() {
  return {"papers", "Repeat both papers' experiments in simulation, by their methods and the default one, as a page",
          [](const cli::OptionList& command) {
            const auto options = std::make_shared<Options>();
            add_options(command, *options);
            return [options, command] { return run(*options, "knuckle-studies papers" + command.as_given()); };
          }};
}

}  // namespace knuckle::studies
