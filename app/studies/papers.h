// `knuckle-studies papers`: both papers' experiments on one simulated machine, each by its authors' method and by
// Knuckle's default one on the same recordings, as one page with their tables and figures.
#pragma once

#include <functional>
#include <optional>
#include <ostream>
#include <string>

#include "app/cli/command.h"
#include "app/identify/identify.h"
#include "app/identify/identify_data.h"
#include "app/identify/identify_options.h"
#include "app/report/report.h"

namespace knuckle::studies {

/// One experiment, and what both methods found in its recordings.
struct Experiment {
  identify::IdentifyData data;
  identify::Identified theirs, ours;
};

struct MalagutiRepeated {
  /// M 3.1. Poses at rest do not excite the default method: `ours` is that of `digging`, the same machine.
  Experiment poses;
  Experiment digging;  ///< M 3.2.
};

/// A paper's experiments, or why this machine could not repeat them.
template <typename Experiments>
struct Repeated {
  std::optional<Experiments> done;
  std::string why_not;
  std::string lacks;  ///< What it would need that nobody measures on this machine; empty: nothing.
};

struct RepeatedPapers {
  std::string machine;  ///< Such as "solar015, worn, seed 3".
  Repeated<MalagutiRepeated> malaguti;
  Repeated<Experiment> kim;
  [[nodiscard]] bool complete() const noexcept { return malaguti.done && kim.done; }
};

/// Drives and identifies as `knuckle identify --simulate` does.
/// @param options machine, family and seed are used. @param progress done share in [0, 1]; may throw to end it.
/// @throws InputError for a machine or family that is none.
[[nodiscard]] RepeatedPapers repeat_papers(const identify::IdentifyOptions& options,
                                           const std::function<void(double)>& progress);

/// @throws InputError where gnuplot fails.
void write_papers_page(const RepeatedPapers& papers, const report::Origin& origin, std::ostream& out);

[[nodiscard]] cli::Command papers_entry();

}  // namespace knuckle::studies
