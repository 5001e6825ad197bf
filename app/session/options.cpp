#include "app/session/options.h"

#include <string_view>

#include "app/cli/command.h"

namespace knuckle::session {

std::vector<std::string> SimulateOptions::operator_paths() const {
  constexpr std::string_view kPath = "path:", kNextPart = ".mcap,";
  if (!operator_name.starts_with(kPath)) return {};
  std::string rest = operator_name.substr(kPath.size());
  std::vector<std::string> files;
  for (std::size_t end; (end = rest.find(kNextPart)) != std::string::npos; rest.erase(0, end + kNextPart.size()))
    files.push_back(rest.substr(0, end + kNextPart.size() - 1));
  files.push_back(rest);
  return files;
}

bool is_stock(const SimulateOptions& options) {
  SimulateOptions stock;  // every option that is not copied here changes the set-up
  stock.scenario = options.scenario;
  stock.seed = options.seed;
  stock.judge = options.judge;
  stock.verbose = options.verbose;
  if (options.machine == kDefaultMachine) stock.machine = kDefaultMachine;
  for (std::string SimulateOptions::*output :
       {&SimulateOptions::candump, &SimulateOptions::csv, &SimulateOptions::report, &SimulateOptions::json,
        &SimulateOptions::log, &SimulateOptions::flights})
    stock.*output = options.*output;
  return options == stock;
}

sim::LimbClass limb_named(const std::string& name, sim::LimbClass fallback, const std::string& or_else) {
  if (name.empty()) return fallback;
  std::string known;
  for (const auto limb :
       {sim::LimbClass::kRelaxed, sim::LimbClass::kNormal, sim::LimbClass::kCoContracted, sim::LimbClass::kLightGrip}) {
    if (name == sim::name(limb)) return limb;
    known += (known.empty() ? "" : ", ") + std::string(sim::name(limb));
  }
  cli::refuse_option("--operator", name, "must be one of " + known + or_else);
}

sim::PersonClass person_named(const std::string& name, sim::PersonClass fallback) {
  if (name.empty()) return fallback;
  for (const auto person : {sim::PersonClass::kExact, sim::PersonClass::kSteady, sim::PersonClass::kRough}) {
    if (name == sim::name(person)) return person;
  }
  cli::refuse_option("--person", name, "must be one of exact, steady, rough");
}

}  // namespace knuckle::session
