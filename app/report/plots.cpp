#include "app/report/plots.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

#include "core/error.h"

namespace knuckle::report {

namespace fs = std::filesystem;
namespace {

constexpr int kNotFound = 127;

/// A folder that is removed with its owner.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "knuckle-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw InputError("--report: no temporary folder can be created: " + name);
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const fs::path& path() const noexcept { return path_; }

 private:
  fs::path path_;
};

/// Runs gnuplot with one argument; its messages go to a file. @return exit code, kNotFound where it is missing.
int run_gnuplot(std::string argument, const std::string& messages_file) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 2, messages_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  std::string program = "gnuplot";
  std::array<char*, 3> arguments{program.data(), argument.data(), nullptr};
  pid_t child = 0;
  const int error = posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return kNotFound;
  int status = 0;
  if (waitpid(child, &status, 0) != child) return kNotFound;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

/// gnuplot's file, without prolog and name spaces (HTML needs none), sized by its view box, inked by the page.
std::string inlined(std::string svg, const Figure& figure) {
  const std::size_t open = svg.find("<svg");
  const std::size_t body = open == std::string::npos ? open : svg.find('>', open);
  if (body == std::string::npos) throw InputError("--report: gnuplot produced no picture");
  svg.erase(0, body + 1);
  if (const auto title = svg.find("<title>"); title != std::string::npos) {
    const auto end = svg.find("</title>", title);
    svg.erase(title, end + 8 - title);
  }
  replace_all(svg, "rgb( 34,  34,  34)", "currentColor");
  replace_all(svg, "'black'", "'currentColor'");
  replace_all(svg, "\"black\"", "\"currentColor\"");
  std::ostringstream head;
  head << "<svg role=\"img\" viewBox=\"0 0 " << figure.width_px << ' ' << figure.height_px << "\">";
  return head.str() + svg;
}

}  // namespace

void check_gnuplot() {
  const TemporaryFolder folder;
  if (run_gnuplot("--version", folder.path() / "messages") != 0)
    throw InputError("--report: gnuplot is not installed; it draws the plots (Debian: apt install gnuplot-nox)");
}

std::vector<std::string> render_svg(const std::vector<Figure>& figures) {
  const TemporaryFolder folder;
  const auto file_of = [&](std::size_t i) { return folder.path() / (std::to_string(i) + ".svg"); };
  {
    std::ofstream script(folder.path() / "script");
    for (std::size_t i = 0; i < figures.size(); ++i) {
      script << "reset\nset terminal svg size " << figures[i].width_px << ',' << figures[i].height_px << " name 'f" << i
             << "' enhanced font 'sans-serif,13'\nset output '" << file_of(i).string() << "'\n"
             << figures[i].script << "\nset output\n";
    }
  }
  const fs::path messages = folder.path() / "messages";
  const int code = run_gnuplot((folder.path() / "script").string(), messages.string());
  if (code == kNotFound) check_gnuplot();
  if (code != 0) {
    std::string why = content(messages);
    replace_all(why, "\n", " ");
    replace_all(why, "  ", " ");
    throw InputError("--report: gnuplot failed: " + why);
  }
  std::vector<std::string> svgs;
  for (std::size_t i = 0; i < figures.size(); ++i) svgs.push_back(inlined(content(file_of(i)), figures[i]));
  return svgs;
}

namespace {

constexpr std::size_t kBins = 700;  // about one per pixel
constexpr double kLeft = 0.085, kRight = 0.985;
constexpr double kPanelPx = 150, kAxisPx = 54, kTopPx = 10, kGapPx = 34;

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
    double least = std::nan(""), most = least;
    for (std::size_t i = begin; i < end; ++i) {
      least = std::fmin(least, low[i]);  // leaves NaN out
      most = std::fmax(most, high[i]);
    }
    if (std::isnan(least))
      data_ << '\n';  // ends the area
    else
      data_ << t_s[begin] << ' ' << least << ' ' << most << '\n';
  });
  data_ << "EOD\n";
  add_curve("$d" + std::to_string(blocks_++) + " using 1:2:3 with filledcurves fs solid 0.25 noborder lc rgb '" +
            colour + "'" + titled(title));
}

void PanelPlot::mark(double t_s, const std::string& label) {
  marks_ << plot_mark(t_s, label);
}

Figure PanelPlot::figure(double first_s, double last_s) const {
  std::ostringstream script;
  script << data_.str() << plot_style() << "set multiplot\nset lmargin at screen " << kLeft
         << "\nset rmargin at screen " << kRight << "\nset xrange [" << first_s << ':'
         << std::max(last_s, first_s + 1e-3) << "]\n"
         << marks_.str();
  const double panels = static_cast<double>(drawn_.size());
  const int height_px = static_cast<int>(kTopPx + kGapPx / 1.5 + panels * kPanelPx + (panels - 1) * kGapPx + kAxisPx);
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
  return {900, height_px, script.str()};
}

}  // namespace knuckle::report
