// A pipe whose reader sleeps.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <string>

namespace knuckle::test {

class StalledPipe {
 public:
  StalledPipe() {
    if (pipe2(ends_.data(), O_CLOEXEC) != 0) ends_ = {-1, -1};
  }
  ~StalledPipe() {
    leave();
    close(ends_[1]);
  }
  StalledPipe(const StalledPipe&) = delete;
  StalledPipe& operator=(const StalledPipe&) = delete;

  [[nodiscard]] int writing_end() const noexcept { return ends_[1]; }
  /// From now on it takes nothing, until it is read.
  void fill() const {
    // Through a description of its own, so that the writing end itself still waits.
    const int end = open(("/proc/self/fd/" + std::to_string(ends_[1])).c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    const std::array<char, 4096> bytes{};
    while (write(end, bytes.data(), bytes.size()) > 0) {
    }
    while (write(end, bytes.data(), 1) > 0) {
    }
    close(end);
  }
  /// Reads what there is.
  [[nodiscard]] std::string read_all() const {
    const int end = open(("/proc/self/fd/" + std::to_string(ends_[0])).c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    std::string text;
    std::array<char, 4096> part{};
    for (ssize_t count = 0; (count = read(end, part.data(), part.size())) > 0;)
      text.append(part.data(), static_cast<std::size_t>(count));
    close(end);
    return text;
  }
  /// The reader is gone.
  void leave() {
    if (ends_[0] >= 0) close(ends_[0]);
    ends_[0] = -1;
  }

 private:
  std::array<int, 2> ends_{-1, -1};
};

}  // namespace knuckle::test
