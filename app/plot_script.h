// Builds gnuplot scripts: stacked panels over one time axis, with thinned curves and bands.
#pragma once

#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "app/session_record.h"

namespace knuckle::app {

/// Colours that stay apart for colour-blind readers and on light and dark pages (Okabe and Ito).
inline constexpr const char* kBlue = "#0072B2";
inline constexpr const char* kVermilion = "#D55E00";
inline constexpr const char* kGreen = "#009E73";
inline constexpr const char* kSky = "#56B4E9";
inline constexpr const char* kOrange = "#E69F00";
inline constexpr const char* kPurple = "#CC79A7";
inline constexpr const char* kGrey = "#8A8A8A";

using Signal = std::function<double(const Sample&)>;

class PlotScript {
 public:
  PlotScript(const SessionRecord& record, int panels);

  /// Starts the next panel, from the top.
  void panel(const std::string& y_label);
  /// @param style gnuplot line options after the colour, such as "dt 2 lw 1".
  void line(const Signal& signal, const std::string& title, const char* colour, const std::string& style = "lw 1.5");
  void band(const Signal& low, const Signal& high, const std::string& title, const char* colour);
  /// Draws the panels collected so far.
  [[nodiscard]] std::string finish();

 private:
  struct Panel {
    std::string y_label, curves;
  };
  void add_curve(const std::string& curve);

  const SessionRecord& record_;
  int panels_;
  int blocks_ = 0;
  std::ostringstream data_;
  std::vector<Panel> drawn_;
};

inline constexpr double kPanelPx = 150;
/// Height of a figure with so many panels.
[[nodiscard]] int panel_figure_height(int panels);

/// Settings shared by every plot: borders, tics, grid, key.
[[nodiscard]] std::string plot_style();
/// Text that is safe between gnuplot's single quotes.
[[nodiscard]] std::string plot_quoted(const std::string& text);

}  // namespace knuckle::app
