// What every HTML page of Knuckle shares: one style for light and dark screens and for paper, no script, nothing
// fetched.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "app/report/plots.h"

namespace knuckle::report {

/// Text that is safe inside HTML.
[[nodiscard]] std::string escaped(const std::string& text);

/// Of the section with this title, to be linked to.
[[nodiscard]] std::string anchor(const std::string& title);

/// A titled figure of a page.
struct PageFigure {
  std::string title, caption;  ///< HTML.
  Figure figure;
};

/// Up to and including <main>. @param css beyond the shared style.
void write_page_head(std::ostream& out, const std::string& title, const std::string& css = "");
/// Draws all figures in one run of gnuplot; each is a section. @throws InputError where gnuplot is missing or refuses.
void write_figures(std::ostream& out, const std::vector<PageFigure>& figures);
/// A section with one table. @param rows of cells that are HTML already; the first row is the head, and all but the
/// first column are numbers or short.
void write_table(std::ostream& out, const std::string& title, const std::string& caption,
                 const std::vector<std::vector<std::string>>& rows);
void write_page_end(std::ostream& out);

}  // namespace knuckle::report
