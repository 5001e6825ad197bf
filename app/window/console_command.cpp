#include "app/window/console_command.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "app/interrupt.h"
#include "app/window/window.h"

namespace knuckle::app {
namespace {

struct Options {
  bool light = false;
  double scale = 1;
  std::string size = "1280x800";
  std::optional<double> duration_s;
};

void add_options(CLI::App& c, Options& o) {
  c.add_flag("--light", o.light, "Light colours instead of dark ones");
  c.add_option("--scale", o.scale, "Size of everything, on top of the monitor's own scale")->capture_default_str();
  c.add_option("--size", o.size, "Size of the window in pixels, WxH")->capture_default_str();
  c.add_option("--duration", o.duration_s, "End after so many seconds (default: when the window is closed)");
}

WindowOptions window_options(const Options& o) {
  check_range("--scale", o.scale, 0.75, 3, "");
  check_range("--duration", o.duration_s, 0.1, 1e6, " s");
  WindowOptions window{.scale = static_cast<float>(o.scale), .light = o.light};
  char end = 0;
  constexpr int kLeastWidth = 1280, kLeastHeight = 720, kMost = 16384;
  if (std::sscanf(o.size.c_str(), "%dx%d%c", &window.width, &window.height, &end) != 2 || window.width < kLeastWidth ||
      window.height < kLeastHeight || window.width > kMost || window.height > kMost)
    refuse_option("--size", o.size, "must be WxH, at least 1280x720, at most 16384x16384");
  return window;
}

int run(const Options& o) {
  const WindowOptions options = window_options(o);
  const InterruptGuard interrupt;
  Window window(options);
  const auto begin = std::chrono::steady_clock::now();
  const auto ran_s = [begin] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  while (!window.closing() && !interrupt.pending() && ran_s() < o.duration_s.value_or(1e9)) {
    window.begin_frame();
    window.clear();
    window.draw_widgets();
    window.end_frame();
  }
  return 0;
}

}  // namespace

Command console_entry() {
  return {"console", "Operator's window", [](CLI::App& command) {
            const auto options = std::make_shared<Options>();
            add_options(command, *options);
            return [options] { return run(*options); };
          }};
}

}  // namespace knuckle::app
