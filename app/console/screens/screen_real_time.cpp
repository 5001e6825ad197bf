#include <fmt/format.h>

#include <cmath>
#include <string>

#include "app/console/screens/player_panel.h"
#include "app/console/screens/screens.h"
#include "app/console/widgets/plots.h"

namespace knuckle::console::screens {
namespace {

void rows_of_loop(const Ui& ui, Area& rest, std::string_view policy, Duration period, std::uint64_t steps,
                  std::uint64_t overruns) {
  const Theme& t = ui.theme;
  const auto row = [&](std::string_view label, std::string_view number, std::string_view unit) {
    value_row(ui, rest.cut_top(t.px(26)), label, number, unit);
  };
  row("Scheduling granted", policy.empty() ? "-" : policy, "");
  row("Period", fmt::format("{:.2f}", to_seconds(period) * 1e3), "ms");
  row("Steps", fmt::format("{}", steps), "");
  row("Overruns", fmt::format("{}", overruns), "");
}

void own_loop_cards(const Ui& ui, const ConsoleData& data, Area area) {
  const Theme& t = ui.theme;
  const float gap = t.px(10);
  const LoopHealth& loop = data.loop;
  if (data.player != nullptr) {
    const Card card(ui, "THE OPERATOR'S LOOP", area.cut_top(t.px(110)));
    put_lines(t.fonts.body, t.colours.muted, card.inside(),
              "How this loop kept its time was not recorded. What it knew and did in each of its steps was: "
              "knuckle export writes that as a table.");
    return;
  }
  {
    const Card card(ui, "THIS CONSOLE'S LOOP", area.cut_top(t.px(150), gap));
    Area rest = card.inside();
    rows_of_loop(ui, rest, loop.policy.data(), loop.period, loop.steps, loop.overruns);
  }
  const double period_s = to_seconds(loop.period);
  const HistogramRange range{1024ns, 134217728ns, period_s, "period"};
  {
    const Card card(ui, "WAKE-UP LATENESS", area.row(0, 2, gap));
    histogram_plot(ui, card.inside(), "Waking", loop.wake_lateness, range, t.colours.series[0]);
  }
  const Card card(ui, "EXECUTION TIME", area.row(1, 2, gap));
  histogram_plot(ui, card.inside(), "Running", loop.execution, range, t.colours.series[1]);
}

/// Its load and, where it is not sound, below that its state.
void bus_rows(const Ui& ui, Area& rest, const std::string& bus, const MachineStatus::Bus& told) {
  const Theme& t = ui.theme;
  value_row(ui, rest.cut_top(t.px(26)), fmt::format("CAN {} load", bus), fmt::format("{:.0f}", told.load * 100), "%");
  if (told.state != CanState::kActive) lamp(ui, rest.cut_top(t.px(26)), name(told.state), true, t.colours.bad);
}

void machine_loop_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const ConsoleView& view = data.view;
  const Theme& t = ui.theme;
  const MachineStatus& s = view.status;
  const Card card(ui, "THE MACHINE'S LOOP", area, status_freshness(view));
  Area rest = card.inside();
  if (ui.replay && !view.status_heard)
    return (void)put_lines(t.fonts.body, t.colours.muted, rest,
                           "Until then the machine's side had reported nothing of it.");
  const std::string policy =
      s.fifo_priority > 0 ? fmt::format("SCHED_FIFO {}", int{s.fifo_priority}) : "no real-time class";
  rows_of_loop(ui, rest, policy, s.period, s.steps, s.overruns);
  const auto timing = [&](const char* label, const MachineStatus::Timing& timing_of) {
    rest.cut_top(t.px(8));
    put_text(t.fonts.small, t.colours.muted, rest.cut_top(t.px(20)).centre(), Align::kCentre, label);
    const Area row = rest.cut_top(t.px(40));
    const auto cell = [&](int i, const char* name, Duration value) {
      const Area a = row.column(i, 3, t.unit());
      put_text(t.fonts.mono, t.colours.text, {a.centre().x, a.min.y + t.px(10)}, Align::kCentre,
               shown_duration(to_seconds(value)));
      put_text(t.fonts.small, t.colours.muted, {a.centre().x, a.min.y + t.px(30)}, Align::kCentre, name);
    };
    cell(0, "median", timing_of.p50);
    cell(1, "99 % below", timing_of.p99);
    cell(2, "longest", timing_of.max);
  };
  if (s.execution.max > Duration::zero() || s.wake_lateness.max > Duration::zero()) {
    timing("Wake-up lateness", s.wake_lateness);
    timing("Execution time", s.execution);
  } else {
    rest.cut_top(t.px(8));
    put_lines(t.fonts.small, t.colours.muted, rest.cut_top(t.px(60)),
              view.simulated ? "Not timed: a simulated machine's loop runs inside this console's, step by step."
                             : "Not timed yet.");
  }
  rest.cut_top(t.px(8));
  const BusDescription& buses = data.facts.machine.bus;
  for (std::size_t i = 0; i < buses.lines(); ++i)
    bus_rows(ui, rest, buses.second ? buses.line(i).name : "bus", s.buses[i]);
  value_row(ui, rest.cut_top(t.px(26)), "CAN errors", fmt::format("{}", s.can_errors), "");
}

void energy_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const OperatorSide& hand = data.view.hand;
  const Card card(ui, "ENERGY OBSERVER", area);
  Area rest = card.inside();
  const Quantity q = Quantity::kEnergy;
  value_row(ui, rest.cut_top(t.px(26)), "Net work on the hand", ui.units.number(q, hand.hand_energy_J),
            ui.units.unit(q));
  const bool lowered = hand.warning.code == ReasonCode::kEnergyWatchdog;
  lamp(ui, rest.cut_top(t.px(26), t.unit(0.5F)), lowered ? "Reduces the felt force" : "Passes the full force", lowered,
       t.colours.notice);
  double most = 0.1;
  for (std::size_t i = 0; i < data.plots.history().size(); ++i)
    most = std::fmax(most, std::abs(data.plots.history().ago(i).hand_energy_J));
  most = std::exp2(std::ceil(std::log2(most)));
  const std::array lines{
      Line{"net work on the hand", t.colours.series[3], [](const History::Sample& s) { return s.hand_energy_J; }}};
  history_plot(
      ui, rest, data.plots.history(), lines,
      {-most, most, ui.units.text(q, -most), fmt::format("{}, 10 s", ui.units.text(q, most)), History::kUnknown, true},
      data.plots.cursor());
}

}  // namespace

DrawnScreen real_time_screen(const Ui& ui, const ConsoleData& data, UiState& /*state*/, Area area) {
  const Theme& t = ui.theme;
  const float gap = t.px(10);
  Area right = area.cut_right(t.px(340), gap);
  machine_loop_card(ui, data, right.cut_top(t.px(data.facts.machine.bus.second ? 424 : 370), gap));
  energy_card(ui, data, right);
  own_loop_cards(ui, data, area);
  return std::nullopt;
}

}  // namespace knuckle::console::screens
