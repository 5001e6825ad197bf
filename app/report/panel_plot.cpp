#include "app/report/panel_plot.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "app/report/gnuplot.h"

namespace knuckle::report {
namespace {

constexpr std::size_t kBins = 700;  // about one per pixel
constexpr double kLeft = 0.085, kRight = 0.985;
constexpr double kAxisPx = 54, kTopPx = 10, kGapPx = 34;

/// Calls f(begin, end) for about kBins equal stretches of rows.
void for_each_bin(std::size_t rows, const std::function<void(std::size_t, std::size_t)>& f) {
  const std::size_t bins = std::min(rows, kBins);
  for (std::size_t b = 0; b < bins; ++b) f(rows * b / bins, rows * (b + 1) / bins);
}

std::string titled(const std::string& title) {
  return title.empty() ? " notitle" : " title " + plot_quoted(title);
}

}  // namespace

std::string plot_style() {
  std::ostringstream s;
  s << "set encoding utf8\nset border 3 lw 0.8 lc rgb '" << kInk << "'\nset tics nomirror out scale 0.5\n"
    << "set clip two\nset grid lt 1 lw 0.4 lc rgb '#999999'\nset key above right horizontal maxrows 1 samplen 1.6 "
       "width 1\n"
    << "set xlabel offset 0,0.5\nset xtics offset 0,0.3\n";
  return s.str();
}

std::string plot_quoted(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '\'') safe += '\'';
    if (c == '_' || c == '^' || c == '@' || c == '{' || c == '}' || c == '&' || c == '~')
      safe += ' ';
    else if (c != '\n')
      safe += c;
  }
  return "'" + safe + "'";
}

std::string plot_mark(double t_s, const std::string& label) {
  std::ostringstream s;
  s << "set arrow from " << t_s << ", graph 0 to " << t_s << ", graph 1 nohead dt " << (label.empty() ? 3 : 2)
    << " lw 1 lc rgb '" << (label.empty() ? kGrey : kVermilion) << "'\n";
  if (!label.empty())
    s << "set label " << plot_quoted(label) << " at " << t_s << ", graph 0.93 left offset 0.4,0 front tc rgb '"
      << kVermilion << "'\n";
  return s.str();
}

PanelPlot::PanelPlot(int panels) : panels_(panels) {
  data_.precision(6);
}

void PanelPlot::panel(const std::string& y_label) {
  drawn_.push_back({y_label, ""});
}

void PanelPlot::add_curve(const std::string& curve) {
  std::string& curves = drawn_.back().curves;
  curves += (curves.empty() ? "plot " : ", ") + curve;
}

void PanelPlot::line(std::span<const double> t_s, std::span<const double> y, const std::string& title,
                     const char* colour, const std::string& style) {
  data_ << "$d" << blocks_ << " << EOD\n";
  for_each_bin(t_s.size(), [&](std::size_t begin, std::size_t end) {
    std::size_t low = begin, high = begin;
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isnan(y[i])) continue;
      if (std::isnan(y[low]) || y[i] < y[low]) low = i;
      if (std::isnan(y[high]) || y[i] > y[high]) high = i;
    }
    for (const std::size_t i : {std::min(low, high), std::max(low, high)}) {
      if (std::isnan(y[i]))
        data_ << '\n';  // lifts the pen
      else
        data_ << t_s[i] << ' ' << y[i] << '\n';
    }
  });
  data_ << "EOD\n";
  add_curve("$d" + std::to_string(blocks_++) + " using 1:2 with lines lc rgb '" + colour + "' " + style +
            titled(title));
}

void PanelPlot::band(std::span<const double> t_s, std::span<const double> low, std::span<const double> high,
                     const std::string& title, const char* colour) {
  data_ << "$d" << blocks_ << " << EOD\n";
  for_each_bin(t_s.size(), [&](std::size_t begin, std::size_t end) {
    double least = low[begin], most = high[begin];
    for (std::size_t i = begin; i < end; ++i) {
      least = std::min(least, low[i]);
      most = std::max(most, high[i]);
    }
    data_ << t_s[begin] << ' ' << least << ' ' << most << '\n';
  });
  data_ << "EOD\n";
  add_curve("$d" + std::to_string(blocks_++) + " using 1:2:3 with filledcurves fs solid 0.25 noborder lc rgb '" +
            colour + "'" + titled(title));
}

void PanelPlot::mark(double t_s, const std::string& label) {
  marks_ << plot_mark(t_s, label);
}

std::string PanelPlot::finish(double first_s, double last_s) const {
  std::ostringstream script;
  script << data_.str() << plot_style() << "set multiplot\nset lmargin at screen " << kLeft
         << "\nset rmargin at screen " << kRight << "\nset xrange [" << first_s << ':'
         << std::max(last_s, first_s + 1e-3) << "]\n"
         << marks_.str();
  const double height_px = panel_figure_height(panels_);
  double top_px = kTopPx + kGapPx / 1.5;
  // Each panel has its own key, above it; a label beside the axis would leave the picture where numbers are long.
  script << "set key at graph 1, graph 1.02 right bottom\n";
  for (std::size_t i = 0; i < drawn_.size(); ++i) {
    const bool last = i + 1 == drawn_.size();
    script << "set tmargin at screen " << 1 - top_px / height_px << "\nset bmargin at screen "
           << 1 - (top_px + kPanelPx) / height_px << "\nset label 1000 " << plot_quoted(drawn_[i].y_label)
           << " at screen 0.014, screen " << 1 - (top_px + kPanelPx / 2) / height_px << " center rotate by 90"
           << "\nset xlabel '" << (last ? "time, s" : "") << "'\nset format x '" << (last ? "%g" : "") << "'\n"
           << drawn_[i].curves << '\n';
    top_px += kPanelPx + kGapPx;
  }
  script << "unset multiplot\n";
  return script.str();
}

int panel_figure_height(int panels) {
  return static_cast<int>(kTopPx + kGapPx / 1.5 + panels * kPanelPx + (panels - 1) * kGapPx + kAxisPx);
}

}  // namespace knuckle::report
