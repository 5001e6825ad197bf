#include "app/report/gnuplot.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

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

}  // namespace knuckle::report
