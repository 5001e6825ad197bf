// Panel plots of a session record: a curve is a signal evaluated at each sample.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/report/panel_plot.h"
#include "app/session/session_record.h"

namespace knuckle::report {

using Signal = std::function<double(const session::Sample&)>;

/// A moment that the page names.
struct PlotMark {
  double t_s = 0;
  std::string label;
};

class PlotScript {
 public:
  PlotScript(const session::SessionRecord& record, int panels, const std::vector<PlotMark>& marks = {});

  /// Starts the next panel, from the top.
  void panel(const std::string& y_label) { plot_.panel(y_label); }
  /// @param style gnuplot line options after the colour, such as "dt 2 lw 1".
  void line(const Signal& signal, const std::string& title, const char* colour, const std::string& style = "lw 1.5");
  void band(const Signal& low, const Signal& high, const std::string& title, const char* colour);
  /// Draws the panels collected so far.
  [[nodiscard]] std::string finish();

 private:
  [[nodiscard]] std::vector<double> values(const Signal& signal) const;

  const session::SessionRecord& record_;
  std::vector<double> t_s_;
  PanelPlot plot_;
};

}  // namespace knuckle::report
