#include "app/report/html.h"

#include <cctype>

namespace knuckle::report {
namespace {

constexpr const char* kStyle =
    R"(:root{color-scheme:light dark;--ink:#1d2429;--soft:#5a6670;--paper:#fff;--page:#f3f4f2;--rule:#dde1e3;
--blue:#0072b2;--vermilion:#d55e00;--good:#00795a;--bad:#b84a00;--hull:#d9a62e;--track:#4a5157;--link:#e8b53a;--bucket:#7b858d;
--edge:#343b41;--rod:#b9c2c9;--ground:#d3cdc1;--soil:#c2a988;--wall:#a9b0b5;--piece:#cc79a7}
@media(prefers-color-scheme:dark){:root{--ink:#e4e8ea;--soft:#9aa6ae;--paper:#1b2024;--page:#13171a;--rule:#333b41;
--blue:#4aa8de;--vermilion:#f08a3c;--good:#35b58f;--bad:#f08a3c;--track:#6a737a;--edge:#0e1114;--ground:#3b3934;--soil:#5b4a37;--wall:#59626a;--bucket:#8d989f}}
*{box-sizing:border-box}body{margin:0;background:var(--page);color:var(--ink);font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:1040px;margin:0 auto;padding:28px 18px 60px}h1{font-size:1.7rem;line-height:1.2;margin:0 0 4px}h2{font-size:1.12rem;margin:0 0 2px}
p{margin:0 0 10px}.soft,figcaption{color:var(--soft);font-size:.9rem}section{background:var(--paper);border:1px solid var(--rule);border-radius:10px;padding:18px 20px;margin-top:18px}
.verdict{display:inline-block;font-weight:650;border-radius:16px;padding:2px 14px;margin:10px 0 0;color:var(--paper);background:var(--good)}.verdict.bad{background:var(--bad)}.verdict.none{background:var(--soft)}
.facts{display:grid;grid-template-columns:repeat(auto-fill,minmax(150px,1fr));gap:12px 20px;margin:18px 0 0}.facts div{border-top:2px solid var(--rule);padding-top:6px}
dt{color:var(--soft);font-size:.82rem}dd{margin:0;font-size:1.12rem;font-variant-numeric:tabular-nums}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}th{text-align:left;color:var(--soft);font-weight:500;font-size:.85rem}
td,th{padding:5px 12px 5px 0;border-bottom:1px solid var(--rule)}tr:last-child td{border-bottom:0}td.n,th.n{text-align:right;white-space:nowrap}.ok{color:var(--good)}.no{color:var(--bad);font-weight:650}
.wide{overflow-x:auto}.plot{min-width:620px}.plot svg{display:block;width:100%;height:auto}.plot svg text{font-family:inherit;fill:currentColor}
figure{margin:0}.strip{display:grid;grid-template-columns:repeat(auto-fill,minmax(285px,1fr));gap:16px}.strip figure{border:1px solid var(--rule);border-radius:8px;overflow:hidden}
.strip figcaption{padding:6px 10px;border-top:1px solid var(--rule)}.strip b{color:var(--ink);font-variant-numeric:tabular-nums}
.key{display:inline-block;width:22px;height:0;border-top:4px solid;vertical-align:middle;margin:0 4px 0 10px}.digest{overflow-wrap:anywhere;font-family:ui-monospace,monospace;font-size:.78rem}
@media(max-width:600px){section>figure>figcaption::after{content:" Swipe sideways for the rest."}}
@media print{body{background:#fff;font-size:11pt}main{padding:0}section{break-inside:avoid;border:0;padding:6px 0;margin-top:8px}h1,h2,figcaption{break-after:avoid}
table{font-size:.8em}td,th{padding:3px 8px 3px 0}.wide{overflow:visible}.strip{grid-template-columns:repeat(3,1fr)}.plot{min-width:0}.plot svg{max-height:215mm}}
)";

}  // namespace

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '&':
        safe += "&amp;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string anchor(const std::string& title) {
  std::string id;
  for (const char c : title) id += c == ' ' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return id;
}

void write_page_head(std::ostream& out, const std::string& title, const std::string& css) {
  out << "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width,initial-scale=1\">\n<title>"
      << escaped(title) << "</title>\n<style>" << kStyle << css << "</style></head><body><main>\n";
}

void write_figures(std::ostream& out, const std::vector<PageFigure>& figures) {
  std::vector<Figure> drawings;
  for (const PageFigure& figure : figures) drawings.push_back(figure.figure);
  const std::vector<std::string> svgs = render_svg(drawings);
  for (std::size_t i = 0; i < figures.size(); ++i)
    out << "<section id=\"" << anchor(figures[i].title) << "\"><figure><h2>" << figures[i].title << "</h2><figcaption>"
        << figures[i].caption << "</figcaption><div class=\"wide\"><div class=\"plot\">" << svgs[i]
        << "</div></div></figure></section>\n";
}

void write_table(std::ostream& out, const std::string& title, const std::string& caption,
                 const std::vector<std::vector<std::string>>& rows) {
  out << "<section id=\"" << anchor(title) << "\"><h2>" << title << "</h2><p class=\"soft\">" << caption
      << "</p><div class=\"wide\"><table>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string cell = i == 0 ? "<th" : "<td";
    out << "<tr>";
    for (std::size_t k = 0; k < rows[i].size(); ++k) out << cell << (k == 0 ? ">" : " class=\"n\">") << rows[i][k];
    out << "</tr>\n";
  }
  out << "</table></div></section>\n";
}

void write_page_end(std::ostream& out) {
  out << "</main></body></html>\n";
}

}  // namespace knuckle::report
