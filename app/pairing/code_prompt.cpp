#include "app/pairing/code_prompt.h"

#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <iostream>

namespace knuckle::pairing {
namespace {

constexpr std::size_t kMostTyped = 4096;

/// Without what surrounds it, such as the carriage return of some terminals.
std::string bare(std::string line) {
  std::erase_if(line, [](unsigned char c) { return std::isspace(c) != 0; });
  std::transform(line.begin(), line.end(), line.begin(), [](unsigned char c) { return std::tolower(c); });
  return line;
}

}  // namespace

void CodePrompt::ask() {
  if (::isatty(descriptor_) == 1) (void)::tcflush(descriptor_, TCIFLUSH);
  std::cout << "Is this the code on the other computer? [yes/no] " << std::flush;
}

void CodePrompt::read() {
  pollfd ready{descriptor_, POLLIN, 0};
  if (ended_ || ::poll(&ready, 1, 0) <= 0) return;
  std::array<char, 256> part;
  const ssize_t count = ::read(descriptor_, part.data(), part.size());
  if (count < 0 && (errno == EINTR || errno == EAGAIN)) return;
  ended_ = count <= 0 || typed_.size() > kMostTyped;
  if (count > 0) typed_.append(part.data(), static_cast<std::size_t>(count));
  if (ended_ && !typed_.empty() && typed_.back() != '\n') typed_ += '\n';  // a last line without its end
}

std::optional<CodePrompt::Answer> CodePrompt::answer() {
  read();
  for (auto end = typed_.find('\n'); end != std::string::npos; end = typed_.find('\n')) {
    const std::string line = bare(typed_.substr(0, end));
    typed_.erase(0, end + 1);
    if (line == "yes" || line == "y") return Answer::kYes;
    if (line == "no" || line == "n") return Answer::kNo;
    std::cout << "Type yes or no: " << std::flush;
  }
  if (ended_) return Answer::kEnded;
  return std::nullopt;
}

}  // namespace knuckle::pairing
