#include "app/programs/control_input.h"

#include <poll.h>
#include <unistd.h>

#include <array>

namespace knuckle::programs {
namespace {

constexpr std::size_t kLongestLine = 256;

}  // namespace

void ControlInput::read() {
  if (isatty(descriptor_) == 1 && tcgetpgrp(descriptor_) != getpgrp()) return;
  pollfd ready{descriptor_, POLLIN, 0};
  if (poll(&ready, 1, 0) <= 0) return;
  std::array<char, kLongestLine> part;
  const ssize_t count = ::read(descriptor_, part.data(), part.size());
  ended_ = count <= 0;
  if (count > 0) text_.append(part.data(), static_cast<std::size_t>(count));
}

std::optional<std::string> ControlInput::line() {
  if (!ended_ && text_.find('\n') == std::string::npos) read();
  const auto end = text_.find('\n');
  if (end == std::string::npos) {
    if (text_.size() > kLongestLine) text_.clear();
    return std::nullopt;
  }
  std::string line = text_.substr(0, end);
  text_.erase(0, end + 1);
  return line;
}

std::string obey_control_line(const std::string& line, pairing::ChosenLink& link) {
  if (line.empty()) return "";
  if (line == "release") return link.release();
  if (line == "grant") return link.grant();
  if (line == "take") return link.take_control();
  return "unknown line: release gives control up, grant gives it to who asked last, take asks for it again";
}

}  // namespace knuckle::programs
