#include "app/studies/papers.h"

#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "app/cli/terminal.h"
#include "app/report/plots.h"
#include "core/error.h"

namespace knuckle::studies {
namespace {

using identify::Identified;
using identify::Paper;

/// A method that found no parameters has nothing to show.
void require_result(const Identified& result, Paper experiment, const identify::IdentifyData& data) {
  if (result.summary.covariance.size() > 0) return;
  throw std::runtime_error(data.source + ", experiment " + identify::name(experiment) + ", method " + result.method +
                           ": " + result.summary.reasons.front());
}

Experiment repeated(Paper paper, identify::IdentifyOptions options, const std::function<void(double)>& progress) {
  constexpr double kDriving = 0.6;  // of the time
  options.method = identify::name(paper);
  Experiment experiment;
  experiment.data = identify::drive_for_data(options, [&](double done) { progress(kDriving * done); });
  experiment.theirs = identify::identify(experiment.data, paper);
  require_result(experiment.theirs, paper, experiment.data);
  if (paper == Paper::kStatic) return experiment;
  experiment.ours = identify::identify(experiment.data, std::nullopt, {},
                                       [&](double done) { progress(kDriving + (1 - kDriving) * done); });
  require_result(experiment.ours, paper, experiment.data);
  return experiment;
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
  RepeatedPapers papers;
  try {
    papers = cli::watched(interrupt, "papers", [&](const auto& progress) { return repeat_papers(options, progress); });
  } catch (const InputError&) {
    throw;
  } catch (const std::runtime_error& stopped) {  // the machine did not engage or dropped out, or nothing was found
    std::cerr << "knuckle-studies papers: not repeated: " << stopped.what() << '\n';
    return 1;
  }
  write_papers_page(papers, {command_line, cli::now_utc()}, page.stream());
  page.commit();
  if (!cli::is_standard_output(o.report)) std::cout << "written: " << o.report << '\n';
  return 0;
}

}  // namespace

RepeatedPapers repeat_papers(const identify::IdentifyOptions& options, const std::function<void(double)>& progress) {
  const auto part = [&](double from, double share) { return [=](double done) { progress(from + share * done); }; };
  RepeatedPapers papers{repeated(Paper::kStatic, options, part(0, 0.4)),
                        repeated(Paper::kMalaguti, options, part(0.4, 0.3)),
                        repeated(Paper::kKim, options, part(0.7, 0.3))};
  papers.poses.ours = papers.digging.ours;
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
