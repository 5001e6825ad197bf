#include "app/battery/cell_of_result.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/battery/cell.h"
#include "app/cli/command.h"
#include "core/error.h"
#include "core/text.h"
#include "machine/control_law.h"
#include "machine/load.h"

namespace knuckle::battery {
namespace {

/// Empty where the session could not run.
/// @throws InputError where the result has no row of it.
std::string digest_of_cell(const nlohmann::ordered_json& result, std::uint64_t index, const std::string& file) {
  for (const auto& row : result.value("rows", nlohmann::ordered_json::array())) {
    if (!row.is_object() || row.value("cell", nlohmann::ordered_json()) != index) continue;
    if (row.contains("refused")) return "";
    if (row.contains("digest") && row["digest"].is_string()) return row["digest"].get<std::string>();
  }
  throw InputError(fmt::format("{}: rows: has none of session {}, or one without its digest", file, index));
}

/// A machine's file of the battery is found from where the battery ran. @throws InputError
void check_machine_file(const std::string& machine, const std::string& file) {
  const std::string path = find_config("machine", machine);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    throw InputError(file + ": settings: machine = " + path +
                     ": is not there: run this in the folder in which the battery ran");
}

}  // namespace

session::SimulateOptions cell_of_result(const std::string& name) {
  const std::size_t colon = name.rfind(':');
  std::uint64_t index = 0;
  const char* const end = name.data() + name.size();
  const char* const digits = colon == std::string::npos ? end : name.data() + colon + 1;
  const auto [rest, error] = std::from_chars(digits, end, index);
  if (digits == end || error != std::errc() || rest != end)
    cli::refuse_option("--from-cell", name, "must be FILE:N, such as feel.json:17");
  const std::string file = name.substr(0, colon);
  cli::check_readable("--from-cell", file);
  std::ifstream stream(file, std::ios::binary);
  const auto json = nlohmann::ordered_json::parse(stream, nullptr, false);
  if (json.is_discarded()) throw InputError(file + ": is not complete JSON");
  if (!json.is_object() || !json.contains("settings") ||
      json.value("schema", nlohmann::ordered_json()) != kResultSchema)
    throw InputError(file + ": is not a result of knuckle-studies sweep --battery feel or work");
  const Settings settings = settings_of(json["settings"], file);
  if (index >= settings.sessions)
    cli::refuse_option("--from-cell", name, fmt::format("the battery has sessions 0 to {}", settings.sessions - 1));
  if (!settings.control.empty() && !control_law_named(settings.control))
    throw InputError(file + ": settings: control = " + shortened(settings.control) + ": " + kControlLawChoice);
  check_machine_file(settings.machine, file);
  for (const CommissionedMachine& machine : settings.commissioned) check_machine_file(machine.file, file);
  session::SimulateOptions cell = Drawer(settings).cell(index).options;
  cell.from_cell = name;
  cell.cell_digest = digest_of_cell(json, index, file);
  return cell;
}

}  // namespace knuckle::battery
