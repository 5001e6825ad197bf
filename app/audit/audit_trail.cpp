#include "app/audit/audit_trail.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <utility>

#include "core/error.h"

namespace knuckle::audit {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kMostKinds = 64;  // more count as one
constexpr const char* kOtherKinds = "other";
constexpr auto kLookAgain = std::chrono::milliseconds(1000);

std::string utc_now() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  std::tm time{};
  ::gmtime_r(&now.tv_sec, &time);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &time);
  return fmt::format("{}.{:03}Z", text, now.tv_nsec / 1'000'000);
}

double monotonic_s() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

AuditTrail::Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

AuditTrail::Descriptor& AuditTrail::Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

AuditTrail::AuditTrail(const std::string& folder, const TrailLimits& limits) : folder_(folder), limits_(limits) {
  std::error_code error;
  if (fs::create_directories(folder_, error)) (void)::chmod(folder_.c_str(), 0700);
  if (error) throw InputError("--audit " + folder_ + ": cannot be made: " + error.message());
  lock_ = Descriptor(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (lock_.get() < 0) throw InputError("--audit " + folder_ + ": " + std::strerror(errno));
  if (::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0)
    throw InputError("--audit " + folder_ + ": another program writes its audit trail there: give another folder");
  const auto must = [&](int refused) {
    if (refused != 0) throw InputError("--audit " + folder_ + ": cannot be written: " + std::strerror(refused));
  };
  find_end();
  const std::optional<Head> head = read_head(folder_);
  head_file_ = Descriptor(::open(head_file_of(folder_).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  must(head_file_.get() < 0 ? errno : 0);
  if (!head && number_ == 0) must(write_head());  // before the first line: where lines are, there is a head
  must(file_number_ == 0 ? begin_file(1) : open_file(file_number_));
  if (!agrees_with(head))
    note(kMissingEvent, {{"lines_before", head ? head->number : 0}, {"hash", head ? head->hash : ""}});
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

/// The last whole line, in whichever file it is, and what a killed program has left after it.
void AuditTrail::find_end() {
  const std::vector<std::uint64_t> numbers = file_numbers(folder_);
  if (numbers.empty()) return;
  file_number_ = numbers.back();
  for (auto number = numbers.rbegin(); number != numbers.rend(); ++number) {
    const std::string file = file_of(folder_, *number);
    const FileContent content = read_lines(file);
    if (*number == file_number_) {
      torn_ = content.rest;
      has_header_ = !content.lines.empty();
    }
    if (content.lines.empty()) continue;
    const auto link = link_of(content.lines.back());
    if (!link) {
      throw InputError(
          fmt::format("--audit {}: its last line is no line of an audit trail: see knuckle audit, or give "
                      "another folder",
                      file));
    }
    number_ = link->number;
    last_hash_ = sha256(content.lines.back());
    return;
  }
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
      const auto link = link_of(*line);
      if (link && link->number == head->number) return sha256(*line) == head->hash;
    }
  }
  return false;
}

int AuditTrail::open_file(std::uint64_t number) {
  file_ = Descriptor(
      ::open(file_of(folder_, number).c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (file_.get() < 0) return errno;
  struct stat status {};
  if (::fstat(file_.get(), &status) != 0) return errno;
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

void AuditTrail::note(const std::string& event, Json details, const std::string& kind) {
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
void AuditTrail::enqueue(const std::string& event, Json details) {
  if (waiting_.size() >= limits_.waiting) {
    ++lost_;
    return;
  }
  if (!details.is_object()) details = Json::object();
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
  int refused = 0;
  while (!entries.empty() && (refused = write_entry(entries.front())) == 0) entries.pop_front();
  const int unsafe = sync();
  return refused != 0 ? refused : unsafe;
}

int AuditTrail::write_entry(const Entry& entry) {
  if (!torn_.empty()) {
    const Entry resumed{
        utc_now(), kResumedEvent, monotonic_s(), {{"torn_bytes", torn_.size()}, {"torn_sha256", sha256(torn_)}}};
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
    for (const std::uint64_t number : file_numbers(folder_)) {
      if (number < oldest) ::unlink(file_of(folder_, number).c_str());
    }
  }
  return append(entry);
}

/// One line, whole: of what the disk refused in part, the part is taken back.
/// @param before ends a line that was left unfinished.
int AuditTrail::append(const Entry& entry, const char* before) {
  Json line{{"n", number_ + 1}, {"utc", entry.utc}, {"mono_s", entry.monotonic_s}, {"event", entry.event}};
  line.update(entry.details);
  line["before"] = last_hash_;
  const std::string text = line.dump(-1, ' ', true, Json::error_handler_t::replace);
  const std::string whole = before + text + '\n';
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
  last_hash_ = sha256(text);
  return 0;
}

/// Lines first, then how far they go: the head never promises what is not there.
int AuditTrail::sync() {
  if (::fdatasync(file_.get()) != 0) return errno;
  return number_ == 0 ? 0 : write_head();
}

int AuditTrail::write_head() {
  const std::string head = head_text({number_, last_hash_});
  if (::pwrite(head_file_.get(), head.data(), head.size(), 0) != static_cast<ssize_t>(head.size())) return errno;
  return ::fdatasync(head_file_.get()) == 0 ? 0 : errno;
}

}  // namespace knuckle::audit
