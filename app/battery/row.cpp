#include "app/battery/row.h"

#include <cmath>

#include "app/cli/interrupt.h"
#include "app/session/session_result.h"
#include "core/error.h"

namespace knuckle::battery {
namespace {

Row number(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Row(*value) : Row();
}

}  // namespace

Row run_cell(const Cell& cell) {
  Row row{{"cell", cell.index}, {"drawn", cell.drawn}, {"effects", cell.effects}};
  try {
    session::SessionHooks hooks;
    hooks.progress = [](double) { cli::check_interrupt(); };
    const session::SessionResult session = session::run_simulation(cell.options, hooks);
    const session::Judged judged = session::judge(session);
    for (const session::MetricEntry& entry : session::metric_table())
      row["metrics"][std::string(entry.name)] = number(judged.metrics.*entry.member);
    row["faults"] = Row::array();
    for (const session::FaultRecord& fault : session.record.faults) row["faults"].push_back(name(fault.reason.code));
    row["digest"] = session.digest.whole;
    row["failed"] = Row::array();
    for (const session::CriterionResult& criterion : judged.criteria) {
      if (criterion.missed() && decides(criterion.kind, session.requirements_decide))
        row["failed"].push_back(criterion.name);
    }
  } catch (const InputError& error) {
    row["refused"] = error.what();
  }
  return row;
}

Row run_cell(const Drawer& drawer, std::uint64_t index) {
  Cell cell;
  try {
    cell = drawer.cell(index);
  } catch (const InputError& error) {
    return {{"cell", index}, {"drawn", Row::object()}, {"refused", error.what()}};
  }
  return run_cell(cell);
}

std::optional<double> metric_of(const Row& row, std::string_view metric) {
  if (!was_run(row)) return std::nullopt;
  const auto found = row["metrics"].find(metric);
  if (found == row["metrics"].end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

bool was_run(const Row& row) {
  return !row.contains("refused");
}

bool passed(const Row& row) {
  return was_run(row) && row["failed"].empty();
}

}  // namespace knuckle::battery
