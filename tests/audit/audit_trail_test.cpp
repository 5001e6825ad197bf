// The audit trail: its chain, what breaks it, killed programs, full disks, floods, rotation.
#include "app/audit/audit_trail.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/cli/digest.h"
#include "core/error.h"
#include "tests/audit/audit_folder.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::audit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json json(const std::string& line) {
  return Json::parse(line);
}

TEST_F(Audit, ChainsItsLinesAcrossRuns) {
  write(3);
  write(2);
  const Check check = check_trail(folder);
  EXPECT_EQ(check.broken(), "");
  ASSERT_EQ(check.lines.size(), 6U) << "and the file's own";
  EXPECT_EQ(json(check.lines[0])["event"], "file");
  EXPECT_EQ(json(check.lines[0])["before"], std::string(64, '0'));
  for (std::size_t i = 1; i < 6; ++i) {
    EXPECT_EQ(json(check.lines[i])["n"], i + 1);
    EXPECT_EQ(json(check.lines[i])["before"], cli::sha256(check.lines[i - 1]));
  }
  EXPECT_EQ(json(check.lines[1])["name"], "desk 0");
  EXPECT_EQ(json(check.lines[1])["utc"].get<std::string>().size(), std::string("2026-11-25T07:00:00.000Z").size());
  EXPECT_GT(json(check.lines[1])["mono_s"].get<double>(), 0);
  EXPECT_EQ(check.last.number, 6U);
}

TEST_F(Audit, IsForItsOwnerOnly) {
  write(1);
  for (const std::string& path : {folder, file(), head_file_of(folder)}) {
    struct stat status {};
    ASSERT_EQ(::stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 077U, 0U) << path;
  }
}

TEST_F(Audit, NamesTheFirstLineThatIsNotAsItWasWritten) {
  write(5);
  const std::string whole = test::content(file());
  const std::vector<std::string> lines = check_trail(folder).lines;
  const std::string line = lines[2] + "\n", last = lines[5] + "\n";
  struct Tampering {
    std::string from, to, said;
  };
  for (const Tampering& done : {Tampering{"desk 2", "desk 7", file() + ":5: does not name the hash of the line before"},
                                {"desk 4", "desk 7", file() + ":6: is not the line that was written"},
                                {line, "", file() + ":3: has number 4 after 2"},
                                {line, line + line, file() + ":4: has number 3 after 3"},
                                {last, "", head_file_of(folder) + ": lines 6 to 6 were written, and are not there"}}) {
    change(file(), done.from, done.to);
    EXPECT_TRUE(test::begins(check_trail(folder).broken(), done.said));
    put(file(), whole);
  }
  fs::remove(head_file_of(folder));
  EXPECT_TRUE(test::says(check_trail(folder).broken(), "head: is missing"));
}

/// The head of a killed program is behind its lines.
TEST_F(Audit, AProgramThatBeginsAgainComparesALineInTheMiddleWithTheHead) {
  write(5);
  const std::string line = check_trail(folder).lines[2];
  std::ofstream(head_file_of(folder)) << head_text({3, cli::sha256(line)});
  write(1);
  EXPECT_EQ(check_trail(folder).broken(), "");
  std::ofstream(head_file_of(folder)) << head_text({3, cli::sha256("another line")});
  EXPECT_TRUE(test::begins(check_trail(folder).broken(), file() + ":3: is not the line that was written"));
  write(1);
  EXPECT_TRUE(test::says(check_trail(folder).broken(), "lines before it were removed or changed"));
}

TEST_F(Audit, RotatesWithinItsBoundsAndNoticesThatWhatIsLeftWasCutOffAtItsBeginning) {
  write(200, {.file_bytes = 4000, .files = 3, .lines_of_a_kind = 1 << 20});
  const Check check = check_trail(folder);
  EXPECT_EQ(check.broken(), "");
  EXPECT_EQ(check.files, 3U);
  EXPECT_EQ(file_numbers(folder).size(), 3U);
  ASSERT_FALSE(check.notes.empty());
  EXPECT_TRUE(test::says(check.notes[0], "older files were removed by rotation"));
  const std::string oldest = file(file_numbers(folder).front());
  EXPECT_LT(fs::file_size(oldest), 4500U);
  change(oldest, check.lines[0] + "\n", "");
  EXPECT_EQ(check_trail(folder).broken(),
            oldest + ":1: is not the first line of its file: lines before it were removed");
}

TEST_F(Audit, NoticesAFileThatWasRemoved) {
  write(200, {.file_bytes = 4000, .files = 5, .lines_of_a_kind = 1 << 20});
  const auto numbers = file_numbers(folder);
  ASSERT_EQ(numbers.size(), 5U);
  fs::rename(file(numbers[2]), temporary.file("away"));
  EXPECT_EQ(check_trail(folder).broken(), file(numbers[2]) + ": is missing");
  fs::rename(temporary.file("away"), file(numbers[2]));
  EXPECT_EQ(check_trail(folder).broken(), "");
  fs::rename(file(numbers[0]), temporary.file("away"));
  EXPECT_EQ(check_trail(folder).broken(), file(numbers[0]) + ": is missing, and was not removed by rotation");
  fs::rename(temporary.file("away"), file(numbers[0]));
  fs::remove(file(numbers[4]));
  EXPECT_NE(check_trail(folder).broken().find("were written, and are not there"), std::string::npos);
}

TEST_F(Audit, AnUnfinishedLastLineIsRecognisedAndTheChainGoesOn) {
  write(3);
  std::ofstream(file(), std::ios::app) << R"({"n":5,"utc":"2026-11)";
  Check check = check_trail(folder);
  EXPECT_EQ(check.broken(), "");
  ASSERT_EQ(check.notes.size(), 1U);
  EXPECT_NE(check.notes[0].find(file() + ":5: unfinished"), std::string::npos);
  write(2);
  check = check_trail(folder);
  EXPECT_EQ(check.broken(), "");
  ASSERT_EQ(check.lines.size(), 7U);
  EXPECT_EQ(json(check.lines[4])["event"], "resumed");
  EXPECT_EQ(json(check.lines[4])["torn_bytes"], 21);
  change(file(), "2026-11\n", "2027-11\n");
  EXPECT_NE(check_trail(folder).broken().find(file() + ":5: is no line"), std::string::npos)
      << "not even this may change";
}

TEST_F(Audit, AnUnfinishedPieceOfManyLinesIsToldOnce) {
  write(3);
  std::ofstream(file(), std::ios::app) << "\x01\n\x02\n\x03\n\x04";
  const Check check = check_trail(folder);
  EXPECT_EQ(check.broken(), "");
  ASSERT_EQ(check.notes.size(), 1U);
  EXPECT_TRUE(test::says(check.notes[0], file() + ":5: unfinished"));
}

/// A whole line without its line feed: as far as a killed program came.
TEST_F(Audit, AnUnfinishedLineThatLooksWholeIsNone) {
  write(3);
  const std::string last = check_trail(folder).lines.back();
  std::ofstream(file(), std::ios::app) << R"({"n":5,"event":"x","before":")" + cli::sha256(last) + "\"}";
  write(1);
  EXPECT_EQ(check_trail(folder).broken(), "");
  EXPECT_EQ(check_trail(folder).lines.size(), 6U);
}

TEST_F(Audit, SurvivesSigkillAtAnyTime) {
  for (int round = 0; round < 8; ++round) {
    const pid_t child = fork();
    if (child == 0) {
      AuditTrail trail(folder, {.file_bytes = 3000, .files = 100, .lines_of_a_kind = 1 << 30});
      for (int i = 0;; ++i) {
        trail.note("connected", {{"name", std::string(static_cast<std::size_t>(i % 70), 'x')}});
        if (i % 100 == 0) trail.flush();
      }
    }
    for (int i = 0; i < 1000 && !std::filesystem::exists(folder); ++i) ::usleep(1000);
    ::usleep(static_cast<useconds_t>(10'000 + 7'000 * round));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    if (file_numbers(folder).empty()) continue;
    EXPECT_EQ(check_trail(folder).broken(), "") << round;
  }
  const std::uint64_t before = check_trail(folder).last.number;
  EXPECT_GT(before, 20U);
  write(1, {.file_bytes = 3000, .files = 100});
  EXPECT_EQ(check_trail(folder).broken(), "");
  EXPECT_GT(check_trail(folder).last.number, before);
}

TEST_F(Audit, AFullDiskIsToldAndLosesNothingThatThereIsRoomFor) {
  const SmallDisk disk;
  AuditTrail trail(folder, {.waiting = 10, .lines_of_a_kind = 1 << 20, .try_again = std::chrono::milliseconds(20)});
  trail.note("first");
  trail.flush();
  disk.set(500);
  for (int i = 0; i < 30; ++i) trail.note("more", {{"i", i}});
  trail.flush();
  EXPECT_NE(trail.news().find("cannot be written: File too large"), std::string::npos);
  EXPECT_EQ(check_trail(folder).broken(), "") << "what was refused in part is taken back";
  for (int i = 0; i < 30; ++i) trail.note("more", {{"i", 100 + i}});
  disk.lift();
  EXPECT_NE(news_of(trail).find("is written again"), std::string::npos);
  for (int i = 0; i < 6000 && check_trail(folder).lines.back().find("\"lost\"") == std::string::npos; ++i) {
    trail.note("after", {}, "after");
    ::usleep(5000);
  }
  const Check check = check_trail(folder);
  EXPECT_EQ(check.broken(), "");
  const std::string all = test::content(file());
  EXPECT_TRUE(test::says(all, "\"i\":0")) << "waited for room";
  EXPECT_TRUE(test::says(all, "\"lost\"")) << "and what had none is counted";
}

TEST_F(Audit, AFloodIsCountedInsteadOfWritten) {
  {
    AuditTrail trail(folder, {.lines_of_a_kind = 5});
    for (int i = 0; i < 10'000; ++i) trail.note("refused", {{"address", i}}, "refused unknown");
    trail.note("connected");
  }
  const Check check = check_trail(folder);
  EXPECT_EQ(check.broken(), "");
  ASSERT_EQ(check.lines.size(), 1U + 5 + 1 + 1);
  EXPECT_EQ(json(check.lines.back())["event"], "left_out");
  EXPECT_EQ(json(check.lines.back())["kind"], "refused unknown");
  EXPECT_EQ(json(check.lines.back())["count"], 9995);
}

TEST_F(Audit, OneProgramAtATimeWritesIt) {
  const AuditTrail first(folder);
  EXPECT_TRUE(test::says(test::refusal([&] { const AuditTrail second(folder); }), "another program"));
}

TEST(AuditFiles, AreKeptByTheirNames) {
  for (const char* file : {"audit-000001.jsonl", "a/audit-123456789.jsonl", "head"})
    EXPECT_STREQ(kept_name(file), "is named like a file of an audit trail") << file;
  for (const char* file : {"audit-000001.json", "heads", "head/a.csv"}) EXPECT_EQ(kept_name(file), nullptr) << file;
}

TEST_F(Audit, RefusesAFolderThatCannotBeWrittenAndAFileThatIsNoTrail) {
  EXPECT_THROW(AuditTrail("/dev/full/trail"), InputError);
  fs::create_directory(folder);
  for (const char* text : {"hello\n", "hello"}) {
    put(file(), text);
    EXPECT_THROW(AuditTrail{folder}, InputError);
    EXPECT_EQ(check_trail(folder).broken(), file() + ":1: is no line of an audit trail");
  }
}

TEST(AuditLine, IsPrintableForPeopleWhateverIsInIt) {
  EXPECT_EQ(readable(R"({"n":1,"utc":"2026","event":"e\u001b[2J","a\n":"\u202e","b":[1,"\u007f"],"before":""})"),
            R"(2026 e\x1b[2J: a\x0a=\xe2\x80\xae, b=[1,"\x7f"])");
}

TEST(AuditLine, IsNoneWhereItNestsSoDeepThatPrintingItWouldTakeAllOfTheStack) {
  const auto nested = [](std::size_t depth) {
    return R"({"n":1,"event":"file","before":")" + hash_before_all() + R"(","x":)" + std::string(depth, '[') +
           std::string(depth, ']') + "}";
  };
  EXPECT_TRUE(link_of(nested(15)));
  EXPECT_FALSE(link_of(nested(100'000)));
}

TEST_F(Audit, TextFromOutsideCannotForgeALine) {
  {
    AuditTrail trail(folder);
    trail.note("refused", {{"name", "a\"}\n{\"n\":99\xFF"}});
  }
  const Check check = check_trail(folder);
  EXPECT_EQ(check.broken(), "");
  EXPECT_EQ(check.lines.size(), 2U);
}

}  // namespace
}  // namespace knuckle::audit
