#include "app/audit/audit_trail.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <utility>

#include "app/cli/digest.h"
#include "app/cli/output_file.h"
#include "core/error.h"
#include "core/text.h"

namespace knuckle::audit {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kMostKinds = 64;  // more count as one
constexpr const char* kOtherKinds = "other";
constexpr auto kLookAgain = std::chrono::milliseconds(1000);

std::string utc_now() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return fmt::format("{}.{:03}Z", utc_text(now.tv_sec, "%Y-%m-%dT%H:%M:%S"), now.tv_nsec / 1'000'000);
}

double monotonic_s() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void check_only_owner_writes(const std::string& path, const char* what) {
  cli::check_only_owner_writes(path, what, "change the audit trail");
}

}  // namespace

AuditTrail::AuditTrail(const std::string& folder, const TrailLimits& limits) : folder_(folder), limits_(limits) {
  std::error_code error;
  if (fs::create_directories(folder_, error)) (void)::chmod(folder_.c_str(), 0700);
  if (error) throw InputError("--audit " + folder_ + ": cannot be written: " + error.message());
  check_only_owner_writes(folder_, "folder");
  lock_ = Descriptor(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!lock_) throw InputError("--audit " + folder_ + ": " + std::strerror(errno));
  if (::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0)
    throw InputError("--audit " + folder_ + ": another program writes its audit trail there: give another folder");
  const auto must = [&](int refused) {
    if (refused != 0) throw InputError("--audit " + folder_ + ": cannot be written: " + std::strerror(refused));
  };
  if (fs::exists(head_file_of(folder_))) check_only_owner_writes(head_file_of(folder_), "file");
  const std::optional<Head> head = read_head(folder_);
  find_end(head.has_value());
  head_file_ = Descriptor(::open(head_file_of(folder_).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  must(head_file_ ? 0 : errno);
  if (!head && number_ == 0) must(write_head());  // before the first line: where lines are, there is a head
  must(file_number_ == 0 ? begin_file(1) : open_file(file_number_));
  head_kept_ = !agrees_with(head);
  if (head_kept_) note(kMissingEvent, {{"lines_before", head ? head->number : 0}, {"hash", head ? head->hash : ""}});
  sigset_t all, before;
  sigfillset(&all);  // a program's signals are for its other threads
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { run(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

AuditTrail::~AuditTrail() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

/// The last whole line, in whichever file it is, and what a killed program has left after it. A power cut may have
/// ended that with a line feed: append() writes one before the line that says so.
void AuditTrail::find_end(bool has_head) {
  const std::vector<std::uint64_t> numbers = file_numbers(folder_);
  if (numbers.empty()) return;
  file_number_ = numbers.back();
  check_only_owner_writes(file_of(folder_, file_number_), "file");
  for (auto number = numbers.rbegin(); number != numbers.rend() && number_ == 0; ++number) {
    const FileContent content = read_lines(file_of(folder_, *number));
    const auto last =
        std::find_if(content.lines.rbegin(), content.lines.rend(), [](const Line& line) { return line.link; });
    if (*number == file_number_) {
      for (auto line = last.base(); line != content.lines.end(); ++line) torn_ += line->text + '\n';
      torn_ += content.rest;
      has_header_ = std::any_of(content.lines.begin(), content.lines.end(),
                                [](const Line& line) { return line.link && line.link->event == kFileEvent; });
    }
    if (last == content.lines.rend()) continue;
    number_ = last->link->number;
    last_hash_ = cli::sha256(last->text);
  }
  if (!torn_.empty() && number_ == 0 && !has_head)
    throw InputError("--audit " + file_of(folder_, file_number_) + ": is no audit trail: give another folder");
}

/// Whether the lines go as far as the head says, and are those that it was written for.
bool AuditTrail::agrees_with(const std::optional<Head>& head) const {
  if (!head) return number_ == 0;
  if (head->number >= number_) return head->number == number_ && (number_ == 0 || head->hash == last_hash_);
  if (head->number == 0) return true;
  const std::vector<std::uint64_t> numbers = file_numbers(folder_);
  for (auto number = numbers.rbegin(); number != numbers.rend(); ++number) {
    const FileContent content = read_lines(file_of(folder_, *number));
    for (auto line = content.lines.rbegin(); line != content.lines.rend(); ++line) {
      if (line->link && line->link->number == head->number) return cli::sha256(line->text) == head->hash;
    }
  }
  return false;
}

/// What is refused leaves the file that is open as it is.
int AuditTrail::open_file(std::uint64_t number) {
  Descriptor file(
      ::open(file_of(folder_, number).c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  struct stat status {};
  if (!file || ::fstat(file.get(), &status) != 0) return errno;
  file_ = std::move(file);
  file_size_ = static_cast<std::size_t>(status.st_size);
  file_number_ = number;
  (void)::fsync(lock_.get());  // its name is in the folder
  return 0;
}

int AuditTrail::begin_file(std::uint64_t number) {
  if (const int refused = open_file(number); refused != 0) return refused;
  torn_.clear();
  has_header_ = false;
  return 0;
}

void AuditTrail::note(const std::string& event, cli::Json details, const std::string& kind) {
  const std::lock_guard lock(mutex_);
  std::string key = kind.empty() ? event : kind;
  if (!kinds_.contains(key) && kinds_.size() >= kMostKinds) key = kOtherKinds;
  Kind& of = kinds_[key];
  if (of.written == 0) of.began = Clock::now();
  if (of.written >= limits_.lines_of_a_kind) {
    ++of.left_out;
    return;
  }
  ++of.written;
  enqueue(event, std::move(details));
}

/// With the mutex held.
void AuditTrail::enqueue(const std::string& event, cli::Json details) {
  if (waiting_.size() >= limits_.waiting) {
    ++lost_;
    return;
  }
  waiting_.push_back({utc_now(), event, monotonic_s(), std::move(details)});
  changed_.notify_all();
}

/// With the mutex held: says how many were too many, and counts anew.
void AuditTrail::close_spans(Clock::time_point now, bool all) {
  std::erase_if(kinds_, [&](const auto& one) {
    const auto& [key, kind] = one;
    if (!all && now - kind.began < limits_.span) return false;
    if (kind.left_out > 0) enqueue("left_out", {{"kind", key}, {"count", kind.left_out}});
    return true;
  });
  if (lost_ > 0 && waiting_.size() < limits_.waiting)
    enqueue("lost", {{"count", std::exchange(lost_, 0)}, {"why", "there was no room for them"}});
}

void AuditTrail::flush() {
  std::unique_lock lock(mutex_);
  written_.wait(lock, [this] { return (waiting_.empty() && !writing_) || refused_ != 0; });
}

std::string AuditTrail::news() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, std::nullopt).value_or("");
}

void AuditTrail::run() {
  pthread_setname_np(pthread_self(), "audit");
  std::unique_lock lock(mutex_);
  for (bool last = false; !last;) {
    const auto patience = refused_ != 0 ? limits_.try_again : std::min(kLookAgain, limits_.span);
    changed_.wait_for(lock, patience, [this] { return ending_ || (refused_ == 0 && !waiting_.empty()); });
    last = ending_;
    close_spans(Clock::now(), last);
    if (waiting_.empty()) continue;
    std::deque<Entry> entries = std::exchange(waiting_, {});
    writing_ = true;
    lock.unlock();
    const int refused = write(entries);
    lock.lock();
    writing_ = false;
    waiting_.insert(waiting_.begin(), std::make_move_iterator(entries.begin()), std::make_move_iterator(entries.end()));
    tell(refused);
    written_.notify_all();
  }
}

/// With the mutex held.
void AuditTrail::tell(int error) {
  if (error == refused_) return;
  refused_ = error;
  news_ = "audit trail " + folder_ + ": " +
          (error == 0 ? "is written again" : std::string("cannot be written: ") + std::strerror(error));
}

int AuditTrail::write(std::deque<Entry>& entries) {
  try {
    int refused = 0;
    while (!entries.empty() && (refused = write_entry(entries.front())) == 0) entries.pop_front();
    const int unsafe = sync();
    return refused != 0 ? refused : unsafe;
  } catch (const std::exception&) {
    return ENOMEM;  // All that can be thrown in here; it must not end the program that leads the machine.
  }
}

int AuditTrail::write_entry(const Entry& entry) {
  if (!torn_.empty()) {
    const Entry resumed{
        utc_now(), kResumedEvent, monotonic_s(), {{"torn_bytes", torn_.size()}, {"torn_sha256", cli::sha256(torn_)}}};
    if (const int refused = append(resumed, "\n"); refused != 0) return refused;
    torn_.clear();
  }
  if (has_header_ && file_size_ >= limits_.file_bytes) {
    if (const int unsafe = sync(); unsafe != 0) return unsafe;
    if (const int refused = begin_file(file_number_ + 1); refused != 0) return refused;
  }
  if (!has_header_) {
    const std::uint64_t oldest = file_number_ > limits_.files ? file_number_ - limits_.files + 1 : 1;
    const Entry header{utc_now(), kFileEvent, monotonic_s(), {{"file", file_number_}, {"oldest", oldest}}};
    if (const int refused = append(header); refused != 0) return refused;
    has_header_ = true;
    if (const int unsafe = sync(); unsafe != 0) return unsafe;
    remove_before(oldest);
  }
  if (const int refused = append(entry); refused != 0) return refused;
  if (entry.event == kMissingEvent) head_kept_ = false;
  return 0;
}

/// The oldest first, up to one that cannot be removed: none is ever missing between others.
void AuditTrail::remove_before(std::uint64_t oldest) {
  std::uint64_t number = oldest;
  while (number > 1 && ::access(file_of(folder_, number - 1).c_str(), F_OK) == 0) --number;
  for (; number < oldest; ++number) {
    const std::string file = file_of(folder_, number);
    if (::unlink(file.c_str()) == 0) continue;
    const int error = errno;
    const std::lock_guard lock(mutex_);
    news_ = "audit trail: " + file + ": cannot be removed: " + std::strerror(error);
    return;
  }
}

/// One line, whole: of what the disk refused in part, the part is taken back.
/// @param before ends a line that was left unfinished.
int AuditTrail::append(const Entry& entry, const char* before) {
  cli::Json line{{"n", number_ + 1}, {"utc", entry.utc}, {"mono_s", entry.monotonic_s}, {"event", entry.event}};
  line.update(entry.details);
  line["before"] = last_hash_;
  const std::string text = line.dump_ascii();
  const std::string whole = before + text + '\n';
  std::string hash = cli::sha256(text);
  std::size_t written = 0;
  int refused = 0;
  while (written < whole.size() && refused == 0) {
    const ssize_t count = ::write(file_.get(), whole.data() + written, whole.size() - written);
    if (count >= 0) {
      written += static_cast<std::size_t>(count);
    } else if (errno != EINTR) {
      refused = errno;
    }
  }
  if (refused != 0) {
    // Where not even that is allowed (an append-only file): as after a killed program.
    if (::ftruncate(file_.get(), static_cast<off_t>(file_size_)) != 0) {
      torn_ += whole.substr(0, written);
      file_size_ += written;
    }
    return refused;
  }
  file_size_ += written;
  ++number_;
  last_hash_ = std::move(hash);
  return 0;
}

/// Lines first, then how far they go: the head never promises what is not there.
int AuditTrail::sync() {
  if (::fdatasync(file_.get()) != 0) return errno;
  return number_ == 0 || head_kept_ ? 0 : write_head();
}

int AuditTrail::write_head() {
  const std::string head = head_text({number_, last_hash_});
  if (::pwrite(head_file_.get(), head.data(), head.size(), 0) != static_cast<ssize_t>(head.size())) return errno;
  return ::fdatasync(head_file_.get()) == 0 ? 0 : errno;
}

}  // namespace knuckle::audit
