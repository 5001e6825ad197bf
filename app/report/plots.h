// Runs gnuplot as a child process: script in, SVG out, nothing left behind.
#pragma once

#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace knuckle::report {

/// One figure: commands that draw it. Terminal and output are set here.
struct Figure {
  int width_px = 900, height_px = 300;
  std::string script;
};

/// The colour that becomes the page's text colour, so that plots follow light and dark pages.
inline constexpr const char* kInk = "#222222";

/// Renders all figures in one run of gnuplot. @return for each an <svg> element for use inside HTML.
/// @throws InputError, one line, where gnuplot is missing or refuses.
[[nodiscard]] std::vector<std::string> render_svg(const std::vector<Figure>& figures);

/// @throws InputError where gnuplot is not installed.
void check_gnuplot();

// Builds gnuplot scripts of any time series: stacked panels over one time axis, with thinned curves and bands.

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
  /// The panels over this stretch of time, one below the other.
  [[nodiscard]] Figure figure(double first_s, double last_s) const;
  [[nodiscard]] Figure figure(std::span<const double> t_s) const {
    return figure(t_s.empty() ? 0 : t_s.front(), t_s.empty() ? 1 : t_s.back());
  }

 private:
  struct Panel {
    std::string y_label, curves;
  };
  void add_curve(const std::string& curve);

  int blocks_ = 0;
  std::ostringstream data_, marks_;
  std::vector<Panel> drawn_;
};

/// Settings shared by every plot: borders, tics, grid, key.
[[nodiscard]] std::string plot_style();
/// A line over the whole height of a plot at a time, with or without a label.
[[nodiscard]] std::string plot_mark(double t_s, const std::string& label);
/// Text that is safe between gnuplot's single quotes.
[[nodiscard]] std::string plot_quoted(const std::string& text);

}  // namespace knuckle::report
