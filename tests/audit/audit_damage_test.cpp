// The audit trail where its folder, its disk or the power fails, or where somebody has been at its files.
#include <sys/stat.h>

#include <algorithm>
#include <fstream>

#include "app/audit/audit_files.h"
#include "core/error.h"
#include "tests/audit/audit_folder.h"
#include "tests/support/refusal.h"
#include "tests/support/run_inside.h"
#include "tests/support/says.h"

namespace knuckle::audit {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const TrailLimits kShortFiles{.file_bytes = 500, .lines_of_a_kind = 1 << 20, .try_again = 20ms};

/// Root may read everything: this is another user, with a folder of his own.
class OrdinaryUser {
 public:
  explicit OrdinaryUser(const fs::path& folder) {
    if (::geteuid() != 0) return;
    EXPECT_EQ(::chown(folder.c_str(), kNobody, kNobody), 0);
    EXPECT_EQ(::seteuid(kNobody), 0);
  }
  ~OrdinaryUser() { EXPECT_EQ(::seteuid(::getuid()), 0); }
  OrdinaryUser(const OrdinaryUser&) = delete;
  OrdinaryUser& operator=(const OrdinaryUser&) = delete;

 private:
  static constexpr uid_t kNobody = 65534;
};

void note_some(AuditTrail& trail) {
  for (int i = 0; i < 20; ++i) trail.note("connected", {{"name", "desk " + std::to_string(i)}});
  trail.flush();
}

/// `knuckle audit FOLDER`. @return its exit code.
int audit_command(const std::string& folder, std::string* out = nullptr, std::string* err = nullptr) {
  const test::ProgramRun run = test::run_inside({"knuckle", "", "", {audit_entry()}}, {"audit", folder});
  if (out != nullptr) *out = run.out;
  if (err != nullptr) *err = run.err;
  return run.exit_code;
}

constexpr const char* kMissing = "lines before it were removed or changed while no program wrote here";

TEST_F(Audit, ARotationThatWasRefusedIsTriedAgain) {
  {
    AuditTrail trail(folder, kShortFiles);
    trail.note("first");
    trail.flush();
    fs::create_directory(file(2));  // in the place of the next file
    note_some(trail);
    EXPECT_NE(news_of(trail).find("cannot be written: Is a directory"), std::string::npos);
    fs::remove(file(2));
    EXPECT_NE(news_of(trail).find("is written again"), std::string::npos);
  }
  const Check check = check_trail(folder);
  EXPECT_EQ(check.broken(), "");
  EXPECT_EQ(check.lines.size(), 1 + 20 + check.files) << "nothing is lost";
}

TEST_F(Audit, AFolderThatCanBeListedNoMoreStopsNeitherTheTrailNorTheProgram) {
  const OrdinaryUser user(temporary.path());
  {
    AuditTrail trail(folder, kShortFiles);
    trail.note("first");
    trail.flush();
    fs::permissions(folder, fs::perms::owner_write | fs::perms::owner_exec);
    note_some(trail);
    EXPECT_EQ(trail.news(), "");
    fs::permissions(folder, fs::perms::owner_all);
  }
  const Check check = check_trail(folder);
  EXPECT_EQ(check.broken(), "");
  EXPECT_GT(check.files, 2U);
  EXPECT_EQ(check.lines.size(), 1 + 20 + check.files);
}

TEST_F(Audit, OldFilesThatCannotBeRemovedAreOnlyTold) {
  {
    AuditTrail trail(folder, {.file_bytes = 500, .files = 2, .lines_of_a_kind = 1 << 20});
    trail.note("first");
    trail.flush();
    fs::rename(file(1), temporary.file("away"));
    fs::create_directory(file(1));
    note_some(trail);
    EXPECT_EQ(trail.news(), "audit trail: " + file(1) + ": cannot be removed: Is a directory");
    fs::remove(file(1));
    fs::rename(temporary.file("away"), file(1));
    EXPECT_EQ(check_trail(folder).broken(), "") << "no file in between is removed either";
    note_some(trail);
    EXPECT_EQ(trail.news(), "");
  }
  EXPECT_EQ(check_trail(folder).broken(), "");
  EXPECT_EQ(check_trail(folder).files, 2U);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // They end a program that is out of memory.
TEST_F(Audit, MemoryThatIsMissingIsRefusedLikeAFullDisk) {
  rlimit before{};
  ::getrlimit(RLIMIT_AS, &before);
  {
    AuditTrail trail(folder);
    trail.note("first");
    trail.flush();
    cli::Json details{{"text", std::string(std::size_t{100} << 20, 'x')}};
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlimit limit{pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) + (16 << 20), before.rlim_max};
    ::setrlimit(RLIMIT_AS, &limit);
    trail.note("too large", std::move(details));
    trail.flush();
    EXPECT_NE(trail.news().find("cannot be written: Cannot allocate memory"), std::string::npos);
  }
  ::setrlimit(RLIMIT_AS, &before);
  EXPECT_EQ(check_trail(folder).broken(), "");
}
#endif

TEST_F(Audit, ATrailThatLostAllItsLinesStaysBroken) {
  write(5);
  fs::remove(file());
  EXPECT_EQ(check_trail(folder).broken(), head_file_of(folder) + ": lines 1 to 6 were written, and are not there");
  EXPECT_EQ(audit_command(folder), 1);
  write(1);
  EXPECT_EQ(check_trail(folder).broken(), file() + ":2: " + kMissing);

  put(file(), "");
  EXPECT_NE(check_trail(folder).broken(), "");
  write(1);
  EXPECT_EQ(check_trail(folder).broken(), file() + ":2: " + kMissing);
}

TEST_F(Audit, ADiskThatRefusesHidesNoMissingEnd) {
  write(5);
  change(file(), check_trail(folder).lines[5] + "\n", "");
  const SmallDisk disk;
  disk.set(200);  // enough for the head alone
  write(1);
  EXPECT_NE(check_trail(folder).broken(), "");
  disk.lift();
  write(1);
  EXPECT_EQ(check_trail(folder).broken(), file() + ":6: " + kMissing);
}

TEST_F(Audit, TheCommandPrintsAllLinesAndTheFirstBreakOfEachFile) {
  write(20, kShortFiles);
  const std::size_t lines = check_trail(folder).lines.size();
  ASSERT_GE(check_trail(folder).files, 5U);
  for (const std::uint64_t number : {2U, 4U}) change(file(number), "\"desk ", "\"disk ");
  fs::rename(file(3), temporary.file("away"));
  std::string out, err;
  EXPECT_EQ(audit_command(folder, &out, &err), 1);
  const Check check = check_trail(folder);
  ASSERT_EQ(check.breaks.size(), 3U) << err;
  EXPECT_TRUE(test::begins(check.breaks[0], file(2) + ":"));
  EXPECT_EQ(check.breaks[1], file(3) + ": is missing");
  EXPECT_TRUE(test::begins(check.breaks[2], file(4) + ":"));
  for (const std::string& broken : check.breaks) EXPECT_TRUE(test::says(err, "BROKEN: " + broken + "\n"));
  EXPECT_EQ(static_cast<std::size_t>(std::count(out.begin(), out.end(), '\n')), check.lines.size());
  fs::rename(temporary.file("away"), file(3));
  EXPECT_EQ(check_trail(folder).lines.size(), lines);
  EXPECT_EQ(check_trail(folder).breaks.size(), 2U);
}

TEST_F(Audit, AHeadThatIsAPipeIsRefusedWithoutWaitingForAWriter) {
  write(1);
  fs::remove(head_file_of(folder));
  ASSERT_EQ(::mkfifo(head_file_of(folder).c_str(), 0600), 0);
  std::string err;
  EXPECT_EQ(audit_command(folder, nullptr, &err), 2);
  EXPECT_TRUE(test::says(err, head_file_of(folder) + ": is no regular file"));
  EXPECT_THROW(AuditTrail{folder}, InputError);
}

TEST_F(Audit, TheCommandTellsAnEmptyTrailFromNone) {
  fs::create_directory(folder);
  EXPECT_EQ(audit_command(folder), 2);
  put(file(), "");
  std::string err;
  EXPECT_EQ(audit_command(folder, nullptr, &err), 0);
  EXPECT_TRUE(test::says(err, "no line has been written"));
}

/// Rotation leaves whole files: each begins with a line about itself.
TEST_F(Audit, NoticesThatTheBeginningWasCutOffUpToALineThatWasResumed) {
  write(20, kShortFiles);
  const std::uint64_t newest = file_numbers(folder).back();
  std::ofstream(file(newest), std::ios::app) << R"({"n":99,"utc":"2026-11)";
  while (file_numbers(folder).back() == newest) write(1, {.file_bytes = 2000, .files = 2});
  ASSERT_EQ(file_numbers(folder).front(), newest);
  ASSERT_EQ(check_trail(folder).broken(), "");
  const std::string text = test::content(file(newest));
  put(file(newest), text.substr(text.find(R"({"n":99)")));
  EXPECT_EQ(check_trail(folder).broken(),
            file(newest) + ":3: is not the first line of its file: lines before it were removed");
}

/// The file's own line: what was resumed came before it.
TEST_F(Audit, NoticesThatTheFirstFileBeginsAfterTheFirstLine) {
  fs::create_directory(folder);
  put(file(), R"({"n":1,"utc":"2026-11)");
  put(head_file_of(folder), head_text({0, hash_before_all()}));
  write(1);
  ASSERT_EQ(check_trail(folder).broken(), "");
  const std::string text = test::content(file());
  put(file(), text.substr(text.find(R"({"n":2)")));
  EXPECT_EQ(check_trail(folder).broken(),
            file() + ":1: is not the first line of its file: lines before it were removed");
}

/// The line feed that ends an unfinished line is written together with the line that says so: either may be cut.
TEST_F(Audit, APowerCutAtAnyByteBreaksNothingAndKeepsNoProgramFromStarting) {
  const std::string head = head_text({0, hash_before_all()});  // the disk may have kept it from before the first line
  fs::create_directory(folder);
  put(file(), R"({"n":1,"utc":"2026-11)");
  put(head_file_of(folder), head);
  write(1);
  std::string text = test::content(file());
  const std::size_t resumed = text.find("\"resumed\"");
  ASSERT_NE(resumed, std::string::npos);
  put(file(), text.substr(0, text.find('\n', resumed)));  // all of that line but its line feed
  put(head_file_of(folder), head);
  write(1);
  text = test::content(file());
  std::size_t cuts = 0;
  for (std::size_t size = 0; size < text.size(); ++size) {
    const bool at_end_of_line = text[size] == '\n' || (size > 0 && text[size - 1] == '\n');
    if (!at_end_of_line && size % 37 != 0) continue;
    ++cuts;
    SCOPED_TRACE("cut after " + text.substr(0, size));
    put(file(), text.substr(0, size));
    put(head_file_of(folder), head);
    ASSERT_EQ(check_trail(folder).broken(), "");
    ASSERT_NO_THROW(write(1));
    ASSERT_EQ(check_trail(folder).broken(), "");
  }
  EXPECT_GT(cuts, 30U);
}

TEST_F(Audit, NoticesThatAnUnfinishedLineWasRemoved) {
  write(3);
  std::ofstream(file(), std::ios::app) << R"({"n":5,"utc":"2026-11)";
  write(1);
  change(file(), "{\"n\":5,\"utc\":\"2026-11\n", "");
  EXPECT_EQ(check_trail(folder).broken(),
            file() + ":5: names an unfinished line before it, which is not there as it was");
}

TEST_F(Audit, RefusesWhatOthersMayWrite) {
  write(1);
  for (const std::string& path : {folder, file(), head_file_of(folder)}) {
    const fs::perms before = fs::status(path).permissions();
    fs::permissions(path, before | fs::perms::others_write);
    const std::string said = test::refusal([&] { const AuditTrail trail(folder); });
    EXPECT_TRUE(test::says(said, path + ": mode 0"));
    EXPECT_TRUE(test::says(said, "lets others write it, and so change the audit trail: chmod go-w"));
    fs::permissions(path, before);
  }
  write(1);
  EXPECT_EQ(check_trail(folder).broken(), "");
}

}  // namespace
}  // namespace knuckle::audit
