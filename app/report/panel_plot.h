// Builds gnuplot scripts of any time series: stacked panels over one time axis, with thinned curves and bands.
#pragma once

#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace knuckle::report {

/// Colours that stay apart for colour-blind readers and on light and dark pages (Okabe and Ito).
inline constexpr const char* kBlue = "#0072B2";
inline constexpr const char* kVermilion = "#D55E00";
inline constexpr const char* kGreen = "#009E73";
inline constexpr const char* kSky = "#56B4E9";
inline constexpr const char* kOrange = "#E69F00";
inline constexpr const char* kPurple = "#CC79A7";
inline constexpr const char* kGrey = "#8A8A8A";

class PanelPlot {
 public:
  /// @param panels to come; they share the figure's height.
  explicit PanelPlot(int panels);

  /// Starts the next panel, from the top.
  void panel(const std::string& y_label);
  /// One y per time; where y is NaN the curve has a gap. Curves are thinned to what the eye can see, keeping every
  /// peak.
  /// @param style gnuplot line options after the colour, such as "dt 2 lw 1".
  void line(std::span<const double> t_s, std::span<const double> y, const std::string& title, const char* colour,
            const std::string& style = "lw 1.5");
  void band(std::span<const double> t_s, std::span<const double> low, std::span<const double> high,
            const std::string& title, const char* colour);
  /// A dotted upright line through all panels; with a label, which is at its head, a dashed one.
  void mark(double t_s, const std::string& label = "");
  /// Draws the panels collected so far over this stretch of time.
  [[nodiscard]] std::string finish(double first_s, double last_s) const;

 private:
  struct Panel {
    std::string y_label, curves;
  };
  void add_curve(const std::string& curve);

  int panels_;
  int blocks_ = 0;
  std::ostringstream data_, marks_;
  std::vector<Panel> drawn_;
};

inline constexpr double kPanelPx = 150;
/// Height of a figure with so many panels.
[[nodiscard]] int panel_figure_height(int panels);

/// Settings shared by every plot: borders, tics, grid, key.
[[nodiscard]] std::string plot_style();
/// A line over the whole height of a plot at a time, with or without a label.
[[nodiscard]] std::string plot_mark(double t_s, const std::string& label);
/// Text that is safe between gnuplot's single quotes.
[[nodiscard]] std::string plot_quoted(const std::string& text);

}  // namespace knuckle::report
