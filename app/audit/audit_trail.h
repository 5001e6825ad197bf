// Writes an audit trail (audit_files.h): whoever has something to say never waits for the disk, a thread of the trail
// writes it and has it on the disk (fdatasync) before it takes what came meanwhile. Bounded: files by rotation, memory
// by what waits, a flood of events of one kind by counting them.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "app/audit/audit_files.h"
#include "app/cli/json.h"
#include "core/descriptor.h"

namespace knuckle::audit {

struct TrailLimits {
  std::size_t file_bytes = 1 << 20;  ///< Then a new file begins.
  std::size_t files = 64;            ///< Of which so many are kept.
  std::size_t waiting = 1024;        ///< Entries that wait for the disk.
  int lines_of_a_kind = 20;          ///< In `span`; of more only the number is written, at its end.
  std::chrono::milliseconds span{60'000};
  std::chrono::milliseconds try_again{1000};  ///< After a disk that refused.
};

class AuditTrail {
 public:
  /// Goes on where the files end. The folder is made (mode 0700) where it is missing. @throws InputError where it
  /// cannot be used, where others may write it, where another program writes there, or where the newest file is no
  /// trail.
  explicit AuditTrail(const std::string& folder, const TrailLimits& limits = {});
  /// Writes what waits; what the disk refuses then is lost.
  ~AuditTrail();
  AuditTrail(const AuditTrail&) = delete;
  AuditTrail& operator=(const AuditTrail&) = delete;

  /// Any thread that is not real-time. @param kind events of the same kind are counted where they are too many; empty:
  /// the event's name.
  void note(const std::string& event, cli::Json details = {}, const std::string& kind = "");
  /// What is wrong with the disk, in one line, once each time it begins or ends; an old file that cannot be removed,
  /// once for each new one; empty: nothing new.
  [[nodiscard]] std::string news();
  [[nodiscard]] const std::string& folder() const noexcept { return folder_; }
  /// Until all that was noted is on the disk, or was refused there. For tests and the end of a program.
  void flush();

 private:
  using Clock = std::chrono::steady_clock;
  struct Entry {
    std::string utc, event;
    double monotonic_s = 0;
    cli::Json details;
  };
  struct Kind {
    Clock::time_point began{};
    int written = 0;
    std::uint64_t left_out = 0;
  };

  void find_end(bool has_head);
  [[nodiscard]] bool agrees_with(const std::optional<Head>& head) const;
  void run();
  void close_spans(Clock::time_point now, bool all);
  void enqueue(const std::string& event, cli::Json details);
  /// @return 0, or errno of what was refused: then it stays at the front.
  int write(std::deque<Entry>& entries);
  int write_entry(const Entry& entry);
  void remove_before(std::uint64_t oldest);
  int begin_file(std::uint64_t number);
  int open_file(std::uint64_t number);
  int append(const Entry& entry, const char* before = "");
  int sync();
  int write_head();
  void tell(int error);

  const std::string folder_;
  const TrailLimits limits_;
  Descriptor lock_, file_, head_file_;

  // The trail's thread.
  std::uint64_t number_ = 0, file_number_ = 0;  // of the last line, of the newest file
  std::string last_hash_ = hash_before_all();
  std::size_t file_size_ = 0;
  std::string torn_;         // at the end of the file: a line that a killed program left unfinished
  bool has_header_ = false;  // in the newest file
  bool head_kept_ = false;   // the head proves that lines are missing, until a line says so

  mutable std::mutex mutex_;
  std::condition_variable changed_, written_;
  std::deque<Entry> waiting_;
  std::map<std::string, Kind> kinds_;
  std::uint64_t lost_ = 0;  // entries there was no room for
  bool writing_ = false, ending_ = false;
  int refused_ = 0;
  std::optional<std::string> news_;
  std::thread thread_;
};

}  // namespace knuckle::audit
