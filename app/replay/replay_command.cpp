#include "app/replay/replay_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/interrupt.h"
#include "app/replay/changed_setup.h"
#include "recording/flaws.h"
#include "recording/recording.h"
#include "recording/replay.h"

namespace knuckle::replay {
namespace {

struct Options {
  std::vector<std::string> files;
  std::vector<std::string> with;
  std::string control;
};

void print(const recording::Divergence& first) {
  std::cout << fmt::format("{}: first difference at {:.4f} s (step {}):\n", name(first.side), to_seconds(first.at),
                           first.step);
  for (const std::string& line : first.what) std::cout << "  " << line << '\n';
  std::cout << fmt::format("  read in this step: {}\n", first.inputs.empty() ? "nothing" : "");
  for (const std::string& line : first.inputs) std::cout << "    " << line << '\n';
}

/// The largest differences of each side, relative to nothing: their units are in their names. Of words the first.
void print_fields(const recording::SideResult& side) {
  if (side.fields.empty()) return;
  std::cout << fmt::format("  {:<34} {:>14} {:>10} {:>9}\n", "field", "largest diff.", "at s", "steps");
  for (const auto& [name, field] : side.fields)
    std::cout << fmt::format("  {:<34} {:>14} {:>10.3f} {:>9}\n", name,
                             field.words.empty() ? fmt::format("{:.6g}", field.largest) : field.words,
                             to_seconds(field.at), field.steps);
}

int run(const Options& o) {
  const cli::InterruptGuard interrupt;
  recording::Recording recording(o.files);
  recording::ReplaySetup setup = recording::setup_of(recording);
  change(setup, {o.with, o.control});
  const auto watch = [](Time, const auto& /*loop*/) { cli::check_interrupt(); };
  const recording::ReplayResult result = recording::replay(recording, setup, {watch, watch});
  for (const std::string& remark : remarks(recording)) std::cerr << "knuckle replay: " << remark << '\n';
  for (std::size_t i = 0; i < result.sides.size(); ++i) {
    const recording::SideResult& side = result.sides[i];
    if (!side.recorded) continue;
    std::cout << fmt::format("{}: {} steps, {} different, {} missing\n", name(static_cast<recording::Side>(i)),
                             side.steps, side.differing, side.missing);
    if (side.unreadable > 0)
      std::cout << fmt::format("  {} messages are none of this version's: recorded by version {}\n", side.unreadable,
                               recording.head().version);
    if (side.first) print(*side.first);
    print_fields(side);
  }
  if (!result.changes.empty()) std::cout << "what was held of the machine:\n";
  for (const recording::Change& change : result.changes)
    std::cout << fmt::format("  {:>10.3f} s  {}: recorded \"{}\", replayed \"{}\"\n", to_seconds(change.at),
                             name(change.side), change.recorded, change.replayed);
  const bool whole = recording.damages().empty();
  if (result.identical()) std::cout << (whole ? "identical, bit by bit\n" : "identical as far as it can be read\n");
  if (!o.with.empty() || !o.control.empty()) return whole ? 0 : 1;
  if (!result.identical() && recording.head().version != cli::program_version())
    std::cout << "recorded by version " << recording.head().version << ", run again by " << cli::program_version()
              << '\n';
  return result.identical() && whole ? 0 : 1;
}

}  // namespace

cli::Command replay_entry() {
  return {
      "replay", "Run the loops of a recording again on what they read, and compare bit by bit",
      [](const cli::OptionList& command) {
        const auto options = std::make_shared<Options>();
        command.add_option("RECORDING", options->files, "Recording (.mcap); of several parts all, in their order")
            .required();
        command.add_option(
            "--with", options->with,
            "Machine or device, name or .toml file, in place of the recorded one: what would have differed?");
        command.add_option("--control", options->control, "Bilateral law in place of the recorded one");
        command.add_note(
            "A change is compared open loop: hand and machine move as recorded, whatever the changed loops command. A "
            "changed gain shows other commands and forces, not the motion that it would lead to; for that run knuckle "
            "simulate.");
        return [options] { return run(*options); };
      }};
}

}  // namespace knuckle::replay
