#include "app/options.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <filesystem>
#include <map>
#include <sstream>

#include "core/error.h"

namespace knuckle::app {
namespace {

constexpr const char* kAbout =
    "Knuckle: teleoperation of a dismantling machine with force feedback and no force sensor.\n";
constexpr const char* kExitCodes =
    "Exit codes: 0 done; 1 the session did not meet its criteria; 2 wrong usage or bad input.";
constexpr double kLongestSession_s = 3600, kLongestDelay_ms = 5000;
const std::vector<std::string> kControls{"echo", "direct"};

/// CLI11 would take -1 for a very large seed.
std::string seed_error(const std::string& text) {
  std::uint64_t seed = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (end.ec == std::errc() && end.ptr == text.data() + text.size()) return "";
  return text + " must be a whole number from 0 to 18446744073709551615";
}

void add_simulate(CLI::App& app, SimulateOptions& o) {
  CLI::App& c = *app.add_subcommand("simulate", "Run a headless teleoperation session on virtual time");
  c.footer(kExitCodes);
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
  c.add_flag("--realtime", o.realtime, "Run the loops in real-time threads over UDP loopback");
  c.add_option("--truth", o.truth, "The plant's own parameters (.toml), instead of drawing them from the seed");
  c.add_option("--candump", o.candump, "Write every CAN frame in candump log format (- = standard output)");
  c.add_option("--csv", o.csv, "Write a table at the machine loop's rate");
  c.add_option("--report", o.report, "Write a self-contained HTML report");
  c.add_option("--json", o.json, "Write the result (docs/results.md says what is in it)");
}

[[noreturn]] void refuse(const std::string& option, const std::string& value, const std::string& why) {
  throw InputError(option + " " + value + ": " + why);
}

std::string shown(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

void check_range(const char* option, const std::optional<double>& value, double low, double high, const char* unit) {
  if (!value || (*value >= low && *value <= high)) return;  // a NaN is in no range
  refuse(option, shown(*value), "must be from " + shown(low) + " to " + shown(high) + unit);
}

void check_readable(const std::string& option, const std::string& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) refuse(option, file, "no such file");
  if (std::filesystem::is_directory(file, error)) refuse(option, file, "is a folder, not a file");
  if (!std::filesystem::is_regular_file(file, error)) refuse(option, file, "is not a regular file");
  if (!std::ifstream(file)) refuse(option, file, "cannot be read");
}

/// No two outputs into one place, none over an input.
void check_outputs(const SimulateOptions& o) {
  std::map<std::string, std::string> taken;  // path -> option
  const auto take = [&](const char* option, const std::string& file, bool output) {
    if (file.empty()) return;
    const std::string path =
        file == "-" ? file : std::filesystem::weakly_canonical(std::filesystem::absolute(file)).string();
    const auto [other, is_new] = taken.emplace(path, option);
    if (!is_new && output)
      refuse(option, file,
             "already taken by " + other->second + (file == "-" ? ": only one can be standard output" : ""));
  };
  // Configuration may be named, or be a file of the user's.
  const auto take_file = [&](const char* option, const std::string& file) {
    if (std::filesystem::exists(file)) take(option, file, false);
  };
  take_file("--scenario", o.scenario);
  take_file("--machine", o.machine);
  take_file("--device", o.device);
  take("--map", o.map, false);
  take("--truth", o.truth, false);
  take("--operator", o.operator_path(), false);
  take("--candump", o.candump, true);
  take("--csv", o.csv, true);
  take("--report", o.report, true);
  take("--json", o.json, true);
}

void check(const SimulateOptions& o) {
  if (o.scenario.empty()) refuse("--scenario", "\"\"", "must name a scenario");
  check_range("--duration", o.duration_s, 0.1, kLongestSession_s, " s");
  check_range("--delay-ms", o.delay_ms, 0, kLongestDelay_ms, " ms");
  check_range("--jitter-ms", o.jitter_ms, 0, kLongestDelay_ms, " ms");
  check_range("--loss", o.loss, 0, 1, "");
  if (!o.control.empty() && std::find(kControls.begin(), kControls.end(), o.control) == kControls.end())
    refuse("--control", o.control, "must be echo or direct");
  const bool plays_path = o.operator_name.rfind("path:", 0) == 0;
  if (plays_path && o.operator_path().empty()) refuse("--operator", o.operator_name, "must name a file after path:");
  if (plays_path && o.map.empty()) refuse("--operator", o.operator_name, "needs --map FILE.toml to say how to read it");
  if (!plays_path && !o.map.empty()) refuse("--map", o.map, "only goes with --operator path:FILE.csv");
  if (plays_path) check_readable("--operator", o.operator_path());
  if (!o.map.empty()) check_readable("--map", o.map);
  if (!o.truth.empty()) check_readable("--truth", o.truth);
  check_outputs(o);
}

/// An unset variable of a shell must not mean "as if not given".
void check_given(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() > 0 && option->get_expected_min() > 0 && option->results().front().empty())
      refuse(option->get_name(), "\"\"", "must not be empty");
  }
}

/// CLI11 may answer in several lines, or with no hint of what to do next.
std::string one_line(std::string message) {
  if (const auto end = message.find('\n'); end != std::string::npos) message.resize(end);
  return message + " (see knuckle --help)";
}

}  // namespace

std::string SimulateOptions::operator_path() const {
  return operator_name.rfind("path:", 0) == 0 ? operator_name.substr(5) : "";
}

CommandLine parse_command_line(const std::vector<std::string>& arguments) {
  CommandLine line;
  CLI::App app(kAbout, "knuckle");
  app.set_version_flag("--version", std::string("knuckle ") + KNUCKLE_VERSION);
  app.require_subcommand(1);
  app.footer(std::string("Try: knuckle simulate --scenario dismantle --report report.html\n") + kExitCodes);
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::Throw);
  add_simulate(app, line.simulate);
  try {
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());  // the order CLI11 takes a vector in
    app.parse(std::move(reversed));
  } catch (const CLI::Success& asked) {
    std::ostringstream text, unused;
    app.exit(asked, text, unused);
    line.text = text.str();
    return line;
  } catch (const CLI::ParseError& error) {
    throw InputError(one_line(error.what()));
  }
  check_given(*app.get_subcommand("simulate"));
  check(line.simulate);
  line.command = CommandLine::Command::kSimulate;
  return line;
}

}  // namespace knuckle::app
