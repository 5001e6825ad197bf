#include "app/cli/background_writer.h"

#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <pthread.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <string>
#include <string_view>

namespace knuckle::cli {
namespace {

constexpr int kLookAgain_ms = 50;                     // how late a thread that waits for a reader notices the end
constexpr std::chrono::milliseconds kLeaveTime{500};  // for the thread to notice that it is not waited for any more

std::uint64_t lines_in(std::string_view text) {
  return static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\n'));
}

bool is_regular(int descriptor) {
  struct stat facts {};
  return fstat(descriptor, &facts) == 0 && S_ISREG(facts.st_mode);
}

}  // namespace

struct BackgroundWriter::Shared {
  Shared(int given, AfterRefusal then, std::size_t most)
      : descriptor(fcntl(given, F_DUPFD_CLOEXEC, 3)), regular(is_regular(given)), after(then), most_bytes(most) {}
  ~Shared() {
    if (descriptor >= 0) close(descriptor);
  }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;

  void hand_over(std::string_view text);
  void run();
  /// @return how much of it was written; less than all: refused or abandoned.
  std::size_t write(std::string_view text, int& refused);

  const int descriptor;
  const bool regular;
  const AfterRefusal after;
  const std::size_t most_bytes;
  std::atomic<bool> abandoned{false};

  std::mutex mutex;  // held to look and to swap, never while anything is written
  std::condition_variable changed;
  std::string waiting;
  bool writing = false, closing = false, done = false;
  int refusal = 0;
  std::uint64_t lines_lost = 0, lines_under_way = 0;
};

void BackgroundWriter::Shared::hand_over(std::string_view text) {
  const std::lock_guard lock(mutex);
  // One text may be larger than the bound, if it has the buffer to itself: a whole result.
  const bool full = !waiting.empty() && waiting.size() + text.size() > most_bytes;
  const bool stopped = refusal != 0 && after == AfterRefusal::kStop;
  if (full || stopped || abandoned) {
    lines_lost += lines_in(text);
    return;
  }
  waiting += text;
  changed.notify_all();
}

void BackgroundWriter::Shared::run() {
  pthread_setname_np(pthread_self(), "writer");
  std::string text;
  std::unique_lock lock(mutex);
  for (;;) {
    changed.wait(lock, [this] { return closing || !waiting.empty(); });
    if (waiting.empty()) break;
    text.clear();
    text.swap(waiting);
    writing = true;
    lines_under_way = lines_in(text);
    lock.unlock();
    int refused = 0;
    const std::size_t written = write(text, refused);
    lock.lock();
    writing = false;
    lines_under_way = 0;
    lines_lost += lines_in(std::string_view(text).substr(written));
    if (refused != 0 && refusal == 0) refusal = refused;
    if ((refused != 0 && after == AfterRefusal::kStop) || abandoned) {
      lines_lost += lines_in(waiting);
      waiting.clear();
    }
  }
  done = true;
  changed.notify_all();
}

std::size_t BackgroundWriter::Shared::write(std::string_view text, int& refused) {
  std::size_t written = 0;
  while (written < text.size() && !abandoned) {
    if (!regular) {
      pollfd ready{descriptor, POLLOUT, 0};
      if (poll(&ready, 1, kLookAgain_ms) <= 0) continue;
    }
    // A pipe that takes anything takes so much: the write does not wait. Its file description is shared with others, so
    // it cannot be made non-blocking.
    const std::size_t part = regular ? text.size() - written : std::min<std::size_t>(text.size() - written, PIPE_BUF);
    const ssize_t count = ::write(descriptor, text.data() + written, part);
    if (count >= 0) {
      written += static_cast<std::size_t>(count);
    } else if (errno != EINTR && errno != EAGAIN) {
      refused = errno;
      break;
    }
  }
  return written;
}

BackgroundWriter::BackgroundWriter(int descriptor, AfterRefusal after, std::size_t most_bytes)
    : shared_(std::make_shared<Shared>(descriptor, after, most_bytes)),
      buffer_([this](std::string_view text) {
        shared_->hand_over(text);
        if (thread_.joinable() || shared_->abandoned) return true;
        // No signal may be handled there: it would be the thread that waits for a reader. And a reader that left, or a
        // limit that is reached, is an error of write() only.
        sigset_t all, before;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before);
        thread_ = std::thread([shared = shared_] { shared->run(); });
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
        return true;
      }),
      stream_(&buffer_) {}

BackgroundWriter::~BackgroundWriter() {
  finish();
}

bool BackgroundWriter::idle() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->waiting.empty() && !shared_->writing;
}

int BackgroundWriter::refusal() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->refusal;
}

std::uint64_t BackgroundWriter::lines_lost() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->lines_lost;
}

void BackgroundWriter::finish(Deadline deadline) {
  stream_.flush();
  if (!thread_.joinable()) return;
  std::unique_lock lock(shared_->mutex);
  const auto done = [this] { return shared_->done; };
  shared_->closing = true;
  shared_->changed.notify_all();
  if (shared_->regular) {
    shared_->changed.wait(lock, done);
  } else if (!shared_->changed.wait_until(lock, deadline, done)) {
    shared_->abandoned = true;
    shared_->changed.wait_for(lock, kLeaveTime, done);
  }
  const bool left = shared_->done;
  if (!left) shared_->lines_lost += lines_in(shared_->waiting) + shared_->lines_under_way;
  shared_->closing = shared_->done = false;
  lock.unlock();
  if (left) {
    thread_.join();
  } else {
    thread_.detach();  // in a write that another writer of the same pipe has made wait; it ends with the process
  }
}

}  // namespace knuckle::cli
