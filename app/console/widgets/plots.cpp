#include "app/console/widgets/plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/console/machine_text.h"
#include "app/console/named_fields.h"

namespace knuckle::console {

double cylinder_speed_mps(const Kinematics& kinematics, const SlaveMessage& machine, int joint) noexcept {
  const auto cylinder = kinematics.cylinder_at(joint, machine.position_rad[joint]);
  return cylinder ? cylinder->lever_m * machine.velocity_radps[joint] : History::kUnknown;
}

double known_force_N(const SlaveMessage& machine) noexcept {
  return machine.confidence > kLeastConfidence ? machine.tip_force_N.norm() : History::kUnknown;
}

History::Sample::Sample() noexcept {
  make_unknown(machine);
  make_unknown(status);
}

void History::add(const Sample& sample) noexcept {
  samples_[next_] = sample;
  next_ = (next_ + 1) % samples_.size();
  count_ = std::min(count_ + 1, samples_.size());
}

History::Sample History::sample_of(const ConsoleView& view, bool machine_known, bool status_known) {
  Sample s;
  if (machine_known) s.machine = view.machine;
  if (status_known) s.status = view.status;
  s.hand_energy_J = view.hand.hand_energy_J;
  return s;
}

void History::set(const std::array<Sample, kSamples>& samples) noexcept {
  samples_.assign(samples.begin(), samples.end());
  next_ = 0;
  count_ = kSamples;
}

const History::Sample* History::of_step(std::int64_t step) const noexcept {
  const std::int64_t steps = last_ - step;
  return steps < 0 || steps >= static_cast<std::int64_t>(count_) ? nullptr : &ago(static_cast<std::size_t>(steps));
}

void History::watch(const ConsoleView& view, bool machine_known, bool status_known) {
  constexpr std::int64_t kHeld = 4;  // steps that a window which draws slowly may hold a value
  const std::int64_t step = step_of(view.now);
  if (step < last_) *this = History(samples_.size());
  if (step == last_) return;
  const Sample s = sample_of(view, machine_known, status_known);
  const std::int64_t steps = last_ < 0 ? 1 : std::min(step - last_, static_cast<std::int64_t>(samples_.size()));
  for (std::int64_t i = 1; i < steps; ++i) add(steps > kHeld ? Sample{} : s);
  add(s);
  last_ = step;
}

namespace {

/// Place of a time on the logarithmic axis, 0..1.
float place(const HistogramRange& range, double seconds) {
  const double low = std::log2(to_seconds(range.from)), high = std::log2(to_seconds(range.to));
  return static_cast<float>((std::log2(std::max(seconds, 1e-9)) - low) / (high - low));
}

/// Words under the axis: decades that lie on it.
void time_axis(const Ui& ui, const Area& area, const HistogramRange& range, float y) {
  const Theme& t = ui.theme;
  for (double tick = 1e-6; tick < 20; tick *= 10) {
    const float share = place(range, tick);
    if (share < -0.001F || share > 1.001F) continue;
    const float x = area.min.x + share * area.width();
    canvas().AddLine({x, area.min.y}, {x, area.max.y}, ink(t.colours.border));
    const std::string text = tick < 0.9e-3 ? fmt::format("{:.0f} \xC2\xB5s", tick * 1e6)
                             : tick < 0.9  ? fmt::format("{:.0f} ms", tick * 1e3)
                                           : fmt::format("{:.0f} s", tick);
    const Align align = share < 0.05F ? Align::kLeft : share > 0.95F ? Align::kRight : Align::kCentre;
    put_text(t.fonts.small, t.colours.muted, {x, y}, align, text);
  }
}

void histogram_bars(const Ui& ui, const Area& area, const Histogram& histogram, const HistogramRange& range,
                    ImU32 colour) {
  // Quarter octaves, whose edges are edges of the histogram's own bins.
  constexpr std::size_t kMost = 128;
  struct Bar {
    float from, to;
    double count;
  };
  std::array<Bar, kMost> bars{};
  std::size_t n = 0;
  double tallest = 1;
  const auto edge = [](int quarter) {
    return Duration((std::int64_t{4} + quarter % 4) << (quarter / 4 + 4));  // 64 ns and up
  };
  for (int quarter = 0; quarter < 112 && n < kMost; ++quarter) {
    const Duration from = edge(quarter), to = edge(quarter + 1);
    if (from < range.from || to > range.to) continue;
    const auto count = static_cast<double>(histogram.count_below(to) - histogram.count_below(from));
    bars[n++] = {place(range, to_seconds(from)), place(range, to_seconds(to)), count};
    tallest = std::max(tallest, count);
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (bars[i].count == 0) continue;
    // Square root: a single late step among thousands stays visible.
    const float share = static_cast<float>(std::sqrt(bars[i].count / tallest));
    const float x0 = area.min.x + bars[i].from * area.width(), x1 = area.min.x + bars[i].to * area.width();
    const float top = area.max.y - std::max(ui.theme.px(2), share * area.height());
    canvas().AddRectFilled({x0 + 0.5F, top}, {std::max(x1 - 0.5F, x0 + 1.5F), area.max.y}, ink(colour));
  }
}

/// A line over the plot, from its newest sample to its oldest; dashed: every second step of a few.
void trace(const Theme& t, const Area& area, const History& history, const Line& line,
           const std::function<float(double)>& y_of, bool dashed) {
  constexpr std::size_t kDash = 3;
  const float step = area.width() / static_cast<float>(History::kSamples - 1);
  std::array<ImVec2, History::kSamples> points;
  std::size_t n = 0;
  const auto stroke = [&] {
    if (n > 1) canvas().AddPolyline(points.data(), static_cast<int>(n), ink(line.colour), 0, t.px(1.75F));
    n = 0;
  };
  for (std::size_t i = 0; i < history.size(); ++i) {
    const double value = line.value(history.ago(i));
    const bool blank = dashed && i / kDash % 2 == 1;
    if (std::isfinite(value)) points[n++] = {area.max.x - static_cast<float>(i) * step, y_of(value)};
    if (!std::isfinite(value) || blank) stroke();  // a gap
  }
  stroke();
}

/// Words in a plot, on a ground of their own: a curve behind them would make them hard to read.
void put_label(const Theme& t, ImU32 colour, ImVec2 at, Align align, const std::string& text) {
  const float width = text_width(t.fonts.small, text), half = t.fonts.small->FontSize * 0.5F;
  const float left = align == Align::kLeft ? at.x : at.x - width;
  canvas().AddRectFilled({left - t.px(2), at.y - half}, {left + width + t.px(2), at.y + half}, ink(t.colours.raised));
  put_text(t.fonts.small, colour, at, align, text);
}

/// Which line is which.
void put_legend(const Theme& t, ImVec2 at, std::span<const Line> lines) {
  for (const Line& line : lines) {
    const float width = text_width(t.fonts.small, line.label);
    put_label(t, t.colours.text, {at.x + t.px(18), at.y}, Align::kLeft, line.label);
    canvas().AddLine(at, {at.x + t.px(14), at.y}, ink(line.colour), t.px(3));
    at.x += width + t.px(30);
  }
}

/// The line of the time shown, and the time that the mouse asks for.
void plot_cursor(const Ui& ui, const Area& area, PlotCursor& cursor) {
  const Theme& t = ui.theme;
  const float x = area.min.x + cursor.share * area.width();
  if (cursor.chosen) {
    canvas().AddLine({x, area.min.y}, {x, area.max.y}, ink(t.colours.text), t.px(1.5F));
    put_label(t, t.colours.notice, {x + t.unit(0.5F), area.min.y + t.fonts.small->FontSize * 0.55F}, Align::kLeft,
              cursor.text);
  }
  if (area.width() < 1 || area.height() < 1) return;
  ImGui::PushID(static_cast<int>(area.min.y));
  pointer_area("plot", area);
  ImGui::PopID();
  // At the press alone: the plot moves under a mouse that is held.
  if (ImGui::IsItemActivated() && area.width() > 0)
    cursor.clicked = std::clamp((ImGui::GetIO().MousePos.x - area.min.x) / area.width(), 0.F, 1.F);
  const float y = area.max.y - t.fonts.small->FontSize * 0.55F;
  put_label(t, t.colours.muted, {area.max.x - t.unit(0.5F), y}, Align::kRight, cursor.chosen ? "+5 s" : "now");
  if (cursor.beside == nullptr) return;
  put_label(t, t.colours.muted, {area.max.x - t.unit(0.5F), area.min.y + t.fonts.small->FontSize * 0.55F},
            Align::kRight, fmt::format("dashed: {}", cursor.beside_name));
}

}  // namespace

void histogram_plot(const Ui& ui, const Area& area, const char* label, const Histogram& histogram,
                    const HistogramRange& range, ImU32 colour) {
  const Theme& t = ui.theme;
  Area rest = area;
  const Area head = rest.cut_top(t.fonts.body->FontSize, t.unit(0.5F));
  put_text(t.fonts.body, t.colours.text, head, Align::kLeft, label);
  const auto text = [](Duration value) { return shown_duration(to_seconds(value)); };
  const std::string summary = histogram.count() == 0
                                  ? (ui.replay ? "not recorded" : "nothing measured yet")
                                  : fmt::format("median {}  99 % below {}  max {}", text(histogram.quantile(0.5)),
                                                text(histogram.quantile(0.99)), text(histogram.max()));
  put_text(t.fonts.mono_small, t.colours.text, head, Align::kRight, summary);
  const Area axis = rest.cut_bottom(t.fonts.small->FontSize * 1.2F);
  canvas().AddRectFilled(rest.min, rest.max, ink(t.colours.raised), t.px(3));
  time_axis(ui, rest, range, axis.centre().y);
  histogram_bars(ui, rest, histogram, range, colour);
  if (range.limit_s > 0) {
    const float x = rest.min.x + place(range, range.limit_s) * rest.width();
    canvas().AddLine({x, rest.min.y}, {x, rest.max.y}, ink(t.colours.bad), t.px(2));
    const bool left = x > rest.centre().x;
    put_text(t.fonts.small, t.colours.bad, {x + (left ? -t.unit(0.5F) : t.unit(0.5F)), rest.min.y + t.px(10)},
             left ? Align::kRight : Align::kLeft, range.limit_label);
  }
}

void band_plot(const Ui& ui, const Area& area, const Bands& bands) {
  const Theme& t = ui.theme;
  const Palette& c = t.colours;
  canvas().AddRectFilled(area.min, area.max, ink(c.raised), t.px(3));
  constexpr float kBands = 4;
  const std::array<ImU32, 4> colours{c.good, c.notice, c.bad, c.bad};
  const auto band_of = [&](float value) {
    std::size_t band = 0;
    while (band < bands.bounds.size() && value > bands.bounds[band]) ++band;
    return band;
  };
  const auto y_of = [&](float value) {
    const std::size_t band = band_of(value);
    const float low = band == 0 ? 0 : bands.bounds[band - 1];
    const float high = band < bands.bounds.size() ? bands.bounds[band] : 2 * low;
    const float share = std::clamp((value - low) / (high - low), 0.F, 1.F);
    return area.max.y - area.height() * (static_cast<float>(band) + share) / kBands;
  };
  const float half = t.fonts.small->FontSize * 0.5F, step = area.width() / static_cast<float>(bands.of);
  const auto put = [&](const Bands::Range& range, const auto& colour_of) {
    for (std::size_t i = 0; range && i < bands.columns; ++i) {
      const auto [least, most] = range(i);
      if (!std::isfinite(most)) continue;
      const float x = area.max.x - static_cast<float>(i + 1) * step;
      canvas().AddRectFilled({x, y_of(most) - t.px(0.75F)}, {x + std::max(step, 1.F), y_of(least) + t.px(0.75F)},
                             ink(colour_of(most)));
    }
  };
  const ImU32 pale = mix(c.raised, c.text, 0.35F);
  put(bands.behind, [pale](float) { return pale; });
  put(bands.range, [&](float most) { return colours[band_of(most)]; });
  for (std::size_t band = 0; band < bands.names.size(); ++band) {
    const float top = area.max.y - area.height() * (static_cast<float>(band) + 1) / kBands;
    const float middle = top + area.height() / kBands / 2;
    put_text(t.fonts.small, c.muted, {area.min.x + t.unit(0.5F), middle}, Align::kLeft, bands.names[band]);
    if (band >= bands.bounds.size()) continue;
    canvas().AddLine({area.min.x, top}, {area.max.x, top}, ink(c.border), t.px(1));
    put_text(t.fonts.small, c.muted, {area.min.x + t.px(54), top + half}, Align::kLeft, bands.bound_text[band]);
  }
  put_text(t.fonts.small, c.muted, {area.max.x - t.unit(0.5F), area.min.y + half + t.px(1)}, Align::kRight,
           bands.span_text);
}

void history_plot(const Ui& ui, const Area& area, const History& history, std::span<const Line> lines, const Axis& axis,
                  PlotCursor& cursor) {
  const Theme& t = ui.theme;
  canvas().AddRectFilled(area.min, area.max, ink(t.colours.raised), t.px(3));
  const auto y_of = [&](double value) {
    const double share = std::clamp((value - axis.low) / (axis.high - axis.low), 0.0, 1.0);
    return area.max.y - static_cast<float>(share) * area.height();
  };
  if (axis.low < 0 && axis.high > 0)
    canvas().AddLine({area.min.x, y_of(0)}, {area.max.x, y_of(0)}, ink(t.colours.border), t.px(1));
  for (const Line& line : lines) {
    trace(t, area, history, line, y_of, false);
    if (cursor.beside != nullptr) trace(t, area, *cursor.beside, line, y_of, true);
  }
  if (std::isfinite(axis.mark)) {
    const float y = std::round(y_of(axis.mark));
    canvas().AddLine({area.min.x, y}, {area.max.x, y}, ink(t.colours.text), t.px(1));
  }
  plot_cursor(ui, area, cursor);
  const float inset = t.unit(0.5F), half = t.fonts.small->FontSize * 0.55F;
  put_label(t, t.colours.muted, {area.min.x + inset, area.min.y + half}, Align::kLeft, axis.high_label);
  if (axis.legend)
    put_legend(t, {area.min.x + 3 * inset + text_width(t.fonts.small, axis.high_label), area.min.y + half}, lines);
  put_label(t, t.colours.muted, {area.min.x + inset, area.max.y - half}, Align::kLeft, axis.low_label);
}

}  // namespace knuckle::console
