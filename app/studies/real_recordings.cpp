#include "app/studies/real_recordings.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "app/cli/json.h"
#include "app/cli/output_file.h"
#include "app/studies/dig_cycles.h"
#include "app/studies/wheel_loader.h"
#include "core/error.h"

namespace knuckle::studies {
namespace {

namespace fs = std::filesystem;

struct Dataset {
  const char* name;
  std::vector<RealRow> (*rows)(const std::string& train_dir, const std::string& test_dir);
};
constexpr std::array<Dataset, 2> kDatasets{
    {{"excavator_dig_cycles", dig_cycle_rows}, {"wheel_loader", wheel_loader_rows}}};

struct Options {
  std::string train, test, json;
};

void print_table(const std::vector<RealRow>& rows, std::ostream& out) {
  for (const RealRow& row : rows) {
    std::ostringstream value;
    value << std::setprecision(4) << row.value;
    if (!row.unit.empty()) value << ' ' << row.unit;
    for (const auto& [name, other] : row.baselines) value << "; " << name << ' ' << other;
    out << std::left << std::setw(22) << row.dataset << std::setw(62) << row.quantity << value.str() << '\n';
  }
}

void check_folders(const std::string& train_dir, const std::string& test_dir) {
  for (const auto& [option, folder] : {std::pair{"--train", train_dir}, {"--test", test_dir}}) {
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored)) cli::refuse_option(option, folder, "is not a folder");
  }
}

/// No output over a file of the folders that are read.
void keep_recordings(const Options& options) {
  cli::Places().output("--json", options.json);
  if (options.json.empty() || cli::is_standard_output(options.json) || !fs::exists(options.json)) return;
  const fs::path json = fs::canonical(options.json);
  for (const auto& [option, folder] : {std::pair{"--train", options.train}, {"--test", options.test}}) {
    const fs::path inside = json.lexically_relative(fs::canonical(folder));
    if (*inside.begin() != "..")
      cli::refuse_option("--json", options.json, std::string("lies in the input folder of ") + option);
  }
}

int run(const Options& options) {
  check_folders(options.train, options.test);
  keep_recordings(options);
  std::optional<cli::OutputFile> json;  // opened first, so that a bad place is known at once
  if (!options.json.empty()) json.emplace("--json", options.json);
  const std::vector<RealRow> rows = real_rows(options.train, options.test, std::cerr);
  if (json) {
    write_real_rows(rows, json->stream());
    json->commit();
  }
  if (!cli::is_standard_output(options.json)) print_table(rows, std::cout);
  return 0;
}

}  // namespace

std::vector<RealRow> real_rows(const std::string& train_dir, const std::string& test_dir, std::ostream& said) {
  check_folders(train_dir, test_dir);
  std::vector<RealRow> rows;
  std::string left_out;
  bool any = false;
  for (const Dataset& dataset : kDatasets) {
    const fs::path train = fs::path(train_dir) / dataset.name, test = fs::path(test_dir) / dataset.name;
    std::error_code ignored;
    const bool in_train = fs::is_directory(train, ignored), in_test = fs::is_directory(test, ignored);
    if (!in_train || !in_test) {
      left_out += std::string("knuckle: ") + dataset.name + " is not in " + (in_train ? test_dir : train_dir) +
                  ": its rows are left out\n";
      continue;
    }
    any = true;
    const std::vector<RealRow> found = dataset.rows(train.string(), test.string());
    rows.insert(rows.end(), found.begin(), found.end());
  }
  if (!any) {
    throw InputError("--train " + train_dir + " and --test " + test_dir +
                     ": must share a folder excavator_dig_cycles or wheel_loader");
  }
  said << left_out;
  return rows;
}

void write_real_rows(const std::vector<RealRow>& rows, std::ostream& out) {
  using cli::Json;
  const auto number = [](double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); };
  Json json{{"schema", kRealRecordingsSchema}, {"version", cli::program_version()}, {"rows", Json::array()}};
  for (const RealRow& row : rows) {
    Json baselines = Json::object();
    for (const auto& [name, value] : row.baselines) baselines[name] = number(value);
    json["rows"].push_back({{"dataset", row.dataset},
                            {"quantity", row.quantity},
                            {"value", number(row.value)},
                            {"unit", row.unit},
                            {"baselines", baselines}});
  }
  out << json.dump(2) << '\n';
}

cli::Command real_recordings_entry() {
  return {
      "real-recordings", "Fit models to recordings of real machines and evaluate them on held-out recordings",
      [](const cli::OptionList& command) {
        const auto options = std::make_shared<Options>();
        command.add_option("--train", options->train, "Folder with excavator_dig_cycles/ and wheel_loader/ for the fit")
            .required();
        command.add_option("--test", options->test, "Folder with the same layout for the evaluation").required();
        command.add_option("--json", options->json, "Write the rows as JSON (described in docs/real-recordings.md)");
        return [options] { return run(*options); };
      }};
}

}  // namespace knuckle::studies
