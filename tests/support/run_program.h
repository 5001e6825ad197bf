// Runs a program as a shell would: arguments in, exit code and both outputs back.
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
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

/// @param interrupt_after if not zero, sends SIGINT after so long.
inline ProgramRun run_program(const std::string& program, std::vector<std::string> arguments,
                              std::chrono::milliseconds interrupt_after = {}) {
  std::string folder = "/tmp/knuckle_run_XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) return {};
  const std::string out = folder + "/out", err = folder + "/err";
  arguments.insert(arguments.begin(), program);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    const int out_file = open(out.c_str(), O_WRONLY | O_CREAT, 0600),
              err_file = open(err.c_str(), O_WRONLY | O_CREAT, 0600);
    dup2(out_file, STDOUT_FILENO);
    dup2(err_file, STDERR_FILENO);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  if (interrupt_after.count() > 0) {
    std::this_thread::sleep_for(interrupt_after);
    kill(child, SIGINT);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ProgramRun run{WIFEXITED(status) ? WEXITSTATUS(status) : -1, program_detail::slurp(out), program_detail::slurp(err)};
  unlink(out.c_str());
  unlink(err.c_str());
  rmdir(folder.c_str());
  return run;
}

}  // namespace knuckle::test
