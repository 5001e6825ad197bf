#include "app/cli/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <sstream>

#include "core/text.h"

namespace knuckle::cli {

PrintableOutput::PrintableOutput(std::ostream& stream)
    : stream_(stream), destination_(stream.rdbuf()), buffer_([this](std::string_view text) {
        const std::string shown = printable_lines(text);
        const auto size = static_cast<std::streamsize>(shown.size());
        return destination_->sputn(shown.data(), size) == size && destination_->pubsync() == 0;
      }) {
  const std::ios::iostate state = stream_.rdstate();  // of one that was refused before, too
  stream_.rdbuf(&buffer_);
  stream_.clear(state);
}

PrintableOutput::~PrintableOutput() {
  stream_.flush();
  const std::ios::iostate state = stream_.rdstate();
  stream_.rdbuf(destination_);
  stream_.clear(state);
}

namespace {

/// Column of the description; 0 for plain text.
std::size_t description_at(const std::string& line) {
  const std::size_t name = line.find_first_not_of(' ');
  if (name == 0 || name == std::string::npos) return 0;
  const std::size_t gap = line.find("  ", name);
  return gap == std::string::npos ? name : line.find_first_not_of(' ', gap);
}

std::string wrapped_line(const std::string& line, std::size_t width) {
  constexpr std::size_t kLeastRoom = 20;
  const std::size_t indent = description_at(line);
  if (line.size() <= width || width < indent + kLeastRoom) return line;
  std::string text = line.substr(0, indent);
  std::size_t column = indent;
  std::istringstream parts(line.substr(indent));
  for (std::string word; parts >> word;) {
    if (column > indent && column + 1 + word.size() > width) {
      text += '\n' + std::string(indent, ' ');
      column = indent;
    }
    const std::string gap = column > indent ? " " : "";
    text += gap + word;
    column += gap.size() + word.size();
  }
  return text;
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t width) {
  std::string all;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) all += wrapped_line(line, width) + '\n';
  return all;
}

std::size_t terminal_width() {
  winsize size{};
  const bool terminal = isatty(STDOUT_FILENO) == 1 && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0;
  return terminal ? size.ws_col : 0;
}

namespace {
constexpr int kCells = 40;
}

ProgressBar::ProgressBar(std::string title) : title_(std::move(title)), on_terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (on_terminal_ && shown_permille_ >= 0) std::fputs("\r\033[K", stderr);
}

void ProgressBar::show(double done_fraction) {
  const int permille = static_cast<int>(1000 * std::clamp(done_fraction, 0.0, 1.0));
  if (!on_terminal_ || permille == shown_permille_) return;
  shown_permille_ = permille;
  std::string bar;
  for (int i = 0; i < kCells; ++i) bar += i * 1000 < permille * kCells ? "█" : "░";
  std::fprintf(stderr, "\r%s %s %3d %%", title_.c_str(), bar.c_str(), permille / 10);
  std::fflush(stderr);
}

}  // namespace knuckle::cli
