// Runs gnuplot as a child process: script in, SVG out, nothing left behind.
#pragma once

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

}  // namespace knuckle::report
