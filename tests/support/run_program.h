// Runs a program as a shell would: arguments in, exit code and both outputs back.
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace knuckle::test {

struct ProgramRun {
  int exit_code = -1;  ///< -1: it did not end by itself.
  std::string out, err;
};

namespace program_detail {

inline std::string slurp(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace program_detail

/// A program that runs while the test goes on. One that is still running at the end is killed.
class RunningProgram {
 public:
  /// @param out, @param err descriptors instead of files that wait() returns; -1: a file.
  RunningProgram(const std::string& program, std::vector<std::string> arguments, int out = -1, int err = -1) {
    if (mkdtemp(folder_.data()) == nullptr) return;
    arguments.insert(arguments.begin(), program);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const std::string out_name = folder_ + "/out", err_name = folder_ + "/err";
    child_ = fork();
    if (child_ != 0) return;
    dup2(out >= 0 ? out : open(out_name.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
    dup2(err >= 0 ? err : open(err_name.c_str(), O_WRONLY | O_CREAT, 0600), STDERR_FILENO);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  ~RunningProgram() {
    signal(SIGKILL);
    (void)wait();
  }
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  [[nodiscard]] pid_t pid() const noexcept { return child_; }
  void signal(int number) const {
    if (child_ > 0) kill(child_, number);
  }
  /// @return whether it has, asked now and again; wait() does not wait then.
  [[nodiscard]] bool ends_within(std::chrono::milliseconds patience) const {
    const auto give_up = std::chrono::steady_clock::now() + patience;
    for (;;) {
      siginfo_t ended{};
      if (child_ <= 0 || waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOHANG | WNOWAIT) != 0)
        return true;
      if (ended.si_pid != 0) return true;
      if (std::chrono::steady_clock::now() > give_up) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  /// Waits until it has said that it notes this signal. @return whether it came to that before it ended.
  [[nodiscard]] bool comes_to_note(int number) const {
    while (!ends_within(std::chrono::seconds(0))) {
      std::ifstream status("/proc/" + std::to_string(child_) + "/status");
      for (std::string line; std::getline(status, line);) {
        constexpr std::string_view kCaught = "SigCgt:";
        if (!line.starts_with(kCaught)) continue;
        if ((std::stoull(line.substr(kCaught.size()), nullptr, 16) >> (number - 1) & 1) != 0) return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
  /// SIGINT after that. @return whether it came to that before it ended.
  bool interrupt_when_it_listens() const {
    const bool notes = comes_to_note(SIGINT);
    if (notes) signal(SIGINT);
    return notes;
  }
  /// Until it has ended.
  ProgramRun wait() {
    if (child_ <= 0) return {};
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = -1;
    const std::string out = folder_ + "/out", err = folder_ + "/err";
    ProgramRun run{WIFEXITED(status) ? WEXITSTATUS(status) : -1, program_detail::slurp(out),
                   program_detail::slurp(err)};
    unlink(out.c_str());
    unlink(err.c_str());
    rmdir(folder_.c_str());
    return run;
  }

 private:
  std::string folder_ = (std::filesystem::temp_directory_path() / "knuckle_run_XXXXXX").string();
  pid_t child_ = -1;
};

/// @param interrupt_after if not zero, sends SIGINT so long after it has begun to note it.
inline ProgramRun run_program(const std::string& program, std::vector<std::string> arguments,
                              std::chrono::milliseconds interrupt_after = {}) {
  RunningProgram running(program, std::move(arguments));
  if (interrupt_after.count() > 0) {
    if (running.comes_to_note(SIGINT)) std::this_thread::sleep_for(interrupt_after);
    running.signal(SIGINT);
  }
  return running.wait();
}

}  // namespace knuckle::test
