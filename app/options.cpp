#include "app/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "app/scenario.h"

namespace knuckle::app {
namespace {

constexpr double kLongestSession_s = 3600, kLongestDelay_ms = 5000;
const std::vector<std::string> kControls{"echo", "direct"};

void add_options(CLI::App& c, SimulateOptions& o) {
  c.add_option("--scenario", o.scenario, "Scenario name or .toml file")->capture_default_str();
  c.add_option("--machine", o.machine, "Machine name or .toml file (default: solar015)");
  c.add_option("--device", o.device,
               "Haptic device name or .toml file (default: knuckle1, or knuckle1_MACHINE where there is one)");
  c.add_option("--operator", o.operator_name, "Operator's limb by name, or path:FILE.csv to play a recorded motion");
  c.add_option("--map", o.map, "Mapping file (.toml) that says how to read the recorded motion");
  c.add_option("--control", o.control, "Bilateral law: echo (default) or direct");
  c.add_option("--duration", o.duration_s, "Stop after so many seconds");
  c.add_option("--seed", o.seed, "Draws the plant's truth, the link and the operator")
      ->capture_default_str()
      ->check(CLI::Validator(seed_error, "", "seed"));
  c.add_option("--delay-ms", o.delay_ms, "Link delay, one way");
  c.add_option("--jitter-ms", o.jitter_ms, "Link jitter, one way");
  c.add_option("--loss", o.loss, "Share of datagrams lost, 0 to 1");
  c.add_option("--assist-force-limit", o.assist_force_limit_N, "Force-limited approach: tip force in N, 0 = off");
  c.add_flag("--assist-stop-on-object", o.assist_stop_on_object, "Stop digging when something stiff is met");
  c.add_flag("--realtime", o.realtime, "Run the loops in real-time threads over UDP loopback");
  c.add_option("--truth", o.truth, "The plant's own parameters (.toml), instead of drawing them from the seed");
  c.add_option("--candump", o.candump, "Write every CAN frame in candump log format (- = standard output)");
  c.add_option("--csv", o.csv, "Write a table at the machine loop's rate");
  c.add_option("--report", o.report, "Write a self-contained HTML report");
  c.add_option("--json", o.json, "Write the result (docs/results.md says what is in it)");
}

void check_places(const SimulateOptions& o) {
  Places places;
  places.configuration("--scenario", o.scenario);
  places.configuration("--machine", o.machine);
  places.configuration("--device", o.device);
  places.input("--map", o.map);
  places.input("--truth", o.truth);
  places.input("--operator", o.operator_path());
  places.output("--candump", o.candump);
  places.output("--csv", o.csv);
  places.output("--report", o.report);
  places.output("--json", o.json);
}

void check(const SimulateOptions& o) {
  if (o.scenario.empty()) refuse_option("--scenario", "\"\"", "must name a scenario");
  check_range("--duration", o.duration_s, 0.1, kLongestSession_s, " s");
  check_range("--delay-ms", o.delay_ms, 0, kLongestDelay_ms, " ms");
  check_range("--jitter-ms", o.jitter_ms, 0, kLongestDelay_ms, " ms");
  check_range("--loss", o.loss, 0, 1, "");
  if (o.assist_force_limit_N && *o.assist_force_limit_N != 0)
    check_range("--assist-force-limit", o.assist_force_limit_N, kLeastAssist_N, kMostAssist_N, " N, or 0: off");
  if (!o.control.empty() && std::find(kControls.begin(), kControls.end(), o.control) == kControls.end())
    refuse_option("--control", o.control, "must be echo or direct");
  const bool plays_path = o.operator_name.rfind("path:", 0) == 0;
  if (plays_path && o.operator_path().empty())
    refuse_option("--operator", o.operator_name, "must name a file after path:");
  if (plays_path && o.map.empty())
    refuse_option("--operator", o.operator_name, "needs --map FILE.toml to say how to read it");
  if (!plays_path && !o.map.empty()) refuse_option("--map", o.map, "only goes with --operator path:FILE.csv");
  if (plays_path) check_readable("--operator", o.operator_path());
  if (!o.map.empty()) check_readable("--map", o.map);
  if (!o.truth.empty()) check_readable("--truth", o.truth);
  check_places(o);
}

}  // namespace

std::string SimulateOptions::operator_path() const {
  return operator_name.rfind("path:", 0) == 0 ? operator_name.substr(5) : "";
}

sim::LimbClass limb_named(const std::string& name, sim::LimbClass fallback, const std::string& or_else) {
  if (name.empty()) return fallback;
  std::string known;
  for (const auto limb :
       {sim::LimbClass::kRelaxed, sim::LimbClass::kNormal, sim::LimbClass::kCoContracted, sim::LimbClass::kLightGrip}) {
    if (name == sim::name(limb)) return limb;
    known += (known.empty() ? "" : ", ") + std::string(sim::name(limb));
  }
  refuse_option("--operator", name, "must be one of " + known + or_else);
}

Command simulate_entry(std::function<int(const SimulateOptions&)> run) {
  return {"simulate", "Run a headless teleoperation session on virtual time",
          [run = std::move(run)](CLI::App& command) {
            const auto options = std::make_shared<SimulateOptions>();
            add_options(command, *options);
            return [options, run] {
              check(*options);
              return run(*options);
            };
          }};
}

}  // namespace knuckle::app
