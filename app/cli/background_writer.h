// Text for a reader or a disk that may stall: written by a thread of its own out of a bounded buffer, so that no thread
// that has something to write ever waits. What there is no room for is lost, and counted.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <ostream>
#include <thread>

#include "app/cli/text_buffer.h"

namespace knuckle::cli {

/// How long a reader may still take what is left when a program ends. A regular file gets all the time it needs.
inline constexpr std::chrono::seconds kReaderPatience{2};

class BackgroundWriter {
 public:
  using Deadline = std::chrono::steady_clock::time_point;
  /// What comes after a write that was refused (disk full, reader gone): nothing more, or the next try.
  enum class AfterRefusal : std::uint8_t { kStop, kGoOn };

  /// @param descriptor is duplicated. @param most_bytes that wait to be written. The thread begins with the first of
  /// them.
  explicit BackgroundWriter(int descriptor, AfterRefusal after = AfterRefusal::kStop, std::size_t most_bytes = 4 << 20);
  /// As finish().
  ~BackgroundWriter();
  BackgroundWriter(const BackgroundWriter&) = delete;
  BackgroundWriter& operator=(const BackgroundWriter&) = delete;

  /// For one thread. A flush hands over what was put in, and does not wait.
  [[nodiscard]] std::ostream& stream() noexcept { return stream_; }
  /// Everything that was handed over has been written, or is lost.
  [[nodiscard]] bool idle() const;
  /// errno of the first write that was refused; 0: none was.
  [[nodiscard]] int refusal() const;
  /// Lines that were not written.
  [[nodiscard]] std::uint64_t lines_lost() const;
  /// The end: waits until all is written, for a reader at most until the deadline. What he did not take by then is
  /// lost.
  void finish(Deadline deadline = std::chrono::steady_clock::now() + kReaderPatience);

 private:
  struct Shared;  // also the thread's, which may be left behind in a write that does not return
  std::shared_ptr<Shared> shared_;
  TextBuffer buffer_;
  std::ostream stream_;
  std::thread thread_;
};

}  // namespace knuckle::cli
