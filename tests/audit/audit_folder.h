// A folder for an audit trail, and what happens to it.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "app/audit/audit_files.h"
#include "app/audit/audit_trail.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::audit {

struct Audit : ::testing::Test {
  test::TemporaryFolder temporary;
  const std::string folder = temporary.file("trail");

  void write(int entries, const TrailLimits& limits = {.lines_of_a_kind = 1 << 20}) const {
    AuditTrail trail(folder, limits);
    for (int i = 0; i < entries; ++i) {
      trail.note("connected", {{"name", "desk " + std::to_string(i)}});
      if (i % 50 == 0) trail.flush();
    }
  }
  [[nodiscard]] std::string file(std::uint64_t number = 1) const { return file_of(folder, number); }
  /// Replaces text in a file, once.
  static void change(const std::string& file, const std::string& from, const std::string& to) {
    std::string text = test::content(file);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    put(file, text.replace(at, from.size(), to));
  }
  static void put(const std::string& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }
  /// The next news of a trail that is expected to have some.
  static std::string news_of(AuditTrail& trail) {
    std::string news;
    for (int i = 0; i < 12'000 && news.empty(); ++i) {
      ::usleep(5000);
      news = trail.news();
    }
    return news;
  }
};

/// A disk on which no file can grow beyond a size.
class SmallDisk {
 public:
  SmallDisk() { ::getrlimit(RLIMIT_FSIZE, &before_); }
  ~SmallDisk() {
    lift();
    ::signal(SIGXFSZ, handler_);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  void set(rlim_t bytes) const {
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  void lift() const { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
  void (*handler_)(int) = ::signal(SIGXFSZ, SIG_IGN);
};

}  // namespace knuckle::audit
