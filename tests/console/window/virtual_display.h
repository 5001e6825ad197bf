// A display of a test's own, and hands on its keyboard and mouse.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <optional>
#include <string>

extern char** environ;

namespace knuckle::console::window {

/// Starts a program that says nothing: what is left over of it must not keep anybody waiting who reads the test's own
/// output. @return its process; nullopt where there is no such program.
inline std::optional<pid_t> start_program(std::vector<std::string> words) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t silent;
  posix_spawn_file_actions_init(&silent);
  for (const int out : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&silent, out, "/dev/null", O_WRONLY, 0);
  pid_t process = 0;
  const int error = posix_spawnp(&process, arguments[0], &silent, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&silent);
  return error == 0 ? std::optional(process) : std::nullopt;
}

/// Real X events: "key F2", "keydown shift", "mousemove 10 20 click 1", or whatever else xdotool takes. @return whether
/// they were taken.
bool xdotool(const std::string& words);
/// Before its server ends.
void let_go_of_display();

/// An X server without a screen, on a number that it finds itself; DISPLAY names it while it lives.
class VirtualDisplay {
 public:
  explicit VirtualDisplay(const std::string& size, const std::vector<std::string>& more = {}) {
    std::array<int, 2> pipe_ends{};
    if (pipe(pipe_ends.data()) != 0) return;
    // It ends with the test, however that ends.
    std::vector<std::string> words{
        "setpriv", "--pdeathsig", "KILL",       "Xvfb",      "-displayfd", std::to_string(pipe_ends[1]),
        "-screen", "0",           size + "x24", "-nolisten", "tcp",        "-noreset"};
    words.insert(words.end(), more.begin(), more.end());
    server_ = start_program(words);
    close(pipe_ends[1]);
    std::string number;
    char c = 0;
    while (server_ && read(pipe_ends[0], &c, 1) == 1 && c != '\n') number += c;
    close(pipe_ends[0]);
    if (number.empty()) return;
    setenv("DISPLAY", (":" + number).c_str(), 1);
    up_ = true;
  }
  ~VirtualDisplay() {
    let_go_of_display();
    unsetenv("DISPLAY");
    if (!server_) return;
    kill(*server_, SIGTERM);
    waitpid(*server_, nullptr, 0);
  }
  VirtualDisplay(const VirtualDisplay&) = delete;
  VirtualDisplay& operator=(const VirtualDisplay&) = delete;
  [[nodiscard]] bool up() const noexcept { return up_; }

 private:
  std::optional<pid_t> server_;
  bool up_ = false;
};

}  // namespace knuckle::console::window
