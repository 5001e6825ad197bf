// What came of one cell of a battery: a line of JSON, the same wherever and whenever it ran.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "app/battery/cell.h"

namespace knuckle::battery {

/// Of a session: {"cell": index, "drawn": {...}, "effects": {...}, "metrics": {name: value or null}, "faults": [code],
/// "digest": hex, "failed": [criterion]}; or, where it could not run, with "refused": why instead of what came of it.
using Row = nlohmann::ordered_json;

/// Runs it. An input that is refused is an answer: the row says why.
[[nodiscard]] Row run_cell(const Cell& cell);
/// The same of a cell that is still to be drawn.
[[nodiscard]] Row run_cell(const Drawer& drawer, std::uint64_t index);

/// By a metric's name in criteria; nothing where the session could not measure it, or did not run.
[[nodiscard]] std::optional<double> metric_of(const Row& row, std::string_view metric);
[[nodiscard]] bool was_run(const Row& row);
[[nodiscard]] bool passed(const Row& row);

}  // namespace knuckle::battery
