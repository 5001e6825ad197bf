#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "app/console/link_watch.h"
#include "app/console/screens/screens.h"
#include "app/console/widgets/plots.h"

namespace knuckle::console::screens {
namespace {

void time_left_card(const Ui& ui, const ConsoleView& view, const Area& area) {
  const Theme& t = ui.theme;
  const LinkSide& link = view.link;
  const Card card(ui, "TIME LEFT BEFORE NEUTRAL", area, machine_freshness(view));
  Area rest = card.inside();
  const double left_s = std::max(0.0, link.neutral_after_s - link.silence_s - ui.view_age_s);
  const float share = link.neutral_after_s > 0 ? static_cast<float>(left_s / link.neutral_after_s) : 0;
  const ImU32 colour = share > 0.6F ? t.colours.good : share > 0.25F ? t.colours.notice : t.colours.bad;
  const std::string number = fixed(std::isnan(link.neutral_after_s) ? link.neutral_after_s : left_s * 1e3, 0);
  put_large(ui, rest.cut_top(t.px(42), t.unit()), t.colours.text, number,
            fmt::format("ms of {} ms", fixed(link.neutral_after_s * 1e3, 0)));
  bar(ui, rest.cut_top(t.px(26), t.unit()), 0, share, colour);
  put_lines(t.fonts.small, t.colours.muted, rest,
            "Counted here from the newest packet received. The machine counts from the newest one it received, and "
            "closes its valves when its time is up.");
}

void figures_card(const Ui& ui, const ConsoleView& view, const Area& area) {
  const Theme& t = ui.theme;
  const LinkSide& link = view.link;
  const Card card(ui, "LAST 10 SECONDS", area, machine_freshness(view));
  Area rest = card.inside();
  const auto row = [&](const char* label, double value, int digits, const char* unit) {
    value_row(ui, rest.cut_top(t.px(27)), label, fixed(value, digits), unit);
  };
  // Nothing of a link that was recorded at its other end alone.
  const double known = std::isnan(link.loss) ? link.loss : 1e3;
  row("Round trip now", link.round_trip_s * 1e3, 1, "ms");
  const double measured = link.round_trip.count() > 0 ? known : std::numeric_limits<double>::quiet_NaN();
  row("Round trip, median", to_seconds(link.round_trip.quantile(0.5)) * measured, 1, "ms");
  row("Round trip, 99 % below", to_seconds(link.round_trip.quantile(0.99)) * measured, 1, "ms");
  row("Lost, machine to here", link.loss * 100, 2, "%");
  row("Age of newest packet", (link.silence_s + ui.view_age_s) * known, 0, "ms");
}

/// A value of a measure, with its unit.
std::string value_text(LinkMeasure measure, double value) {
  if (measure == LinkMeasure::kRoundTrip || measure == LinkMeasure::kJitter) return shown_duration(value);
  return fmt::format("{:.0f} %", 100 * value);
}

/// The last minutes of what the quality word is made of.
void minutes_card(const Ui& ui, const ConsoleData& data, LinkMeasure measure, const Area& area) {
  static constexpr std::array<const char*, kLinkMeasures> kTitles{
      "ROUND TRIP: MEDIAN; PALE: EACH; 10 MINUTES", "LOST, 10 MINUTES", "JITTER: 95 % ARE BELOW, 10 MINUTES",
      "WAIT, OF TIME TO NEUTRAL", "EACH ROUND TRIP, 10 MINUTES"};
  const Card card(ui, kTitles[static_cast<std::size_t>(measure)], area);
  const LinkHistory& history = data.kept.link;
  const QualityBounds& bounds = bounds_of(measure);
  Bands bands;
  const std::array<double, 3> all{bounds.fair, bounds.poor, bounds.bad};
  for (std::size_t i = 0; i < all.size(); ++i) {
    bands.bounds[i] = static_cast<float>(all[i]);
    bands.bound_text[i] = value_text(measure, all[i]);
  }
  bands.names = {name(LinkQuality::kGood), name(LinkQuality::kFair), name(LinkQuality::kPoor), name(LinkQuality::kBad)};
  bands.columns = history.size();
  bands.of = LinkHistory::kSeconds;
  const auto range_of = [&history](LinkMeasure of) {
    return [&history, of](std::size_t ago) {
      const LinkHistory::Range& range = history.ago(ago, of);
      return std::pair(range.least, range.most);
    };
  };
  bands.range = range_of(measure);
  if (measure == LinkMeasure::kRoundTrip) bands.behind = range_of(LinkMeasure::kNewestRoundTrip);
  bands.span_text = data.player != nullptr ? "-10 min to the cursor" : "-10 min to now";
  band_plot(ui, card.inside(), bands);
}

}  // namespace

DrawnScreen link_screen(const Ui& ui, const ConsoleData& data, UiState& /*state*/, Area area) {
  const Theme& t = ui.theme;
  const float gap = t.px(10);
  const ConsoleView& view = data.view;
  Area top = area.cut_top(t.px(196), gap);
  figures_card(ui, view, top.cut_right(t.px(330), gap));
  minutes_card(ui, data, LinkMeasure::kSilence, top.cut_right(top.width() / 2, gap));
  time_left_card(ui, view, top);
  const auto plot = [&](int i, const char* title, LinkMeasure minutes, const Histogram& histogram,
                        HistogramRange range) {
    Area row = area.row(i, 3, gap);
    minutes_card(ui, data, minutes, row.cut_right(row.width() / 2, gap));
    const Card card(ui, title, row, machine_freshness(view));
    histogram_plot(ui, card.inside(), "10 s", histogram, range, t.colours.series[static_cast<std::size_t>(i)]);
  };
  plot(0, "ROUND TRIP", LinkMeasure::kRoundTrip, view.link.round_trip, {262144ns, 2147483648ns});
  plot(1, "ARRIVAL", LinkMeasure::kJitter, view.link.arrival_jitter, {8192ns, 536870912ns});
  plot(2, "HAND TO VALVE", LinkMeasure::kLoss, view.link.hand_to_valve, {262144ns, 2147483648ns});
  return std::nullopt;
}

}  // namespace knuckle::console::screens
