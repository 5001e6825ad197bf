#include "recording/recorder.h"

#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <random>
#include <set>

#include "app/session/session_result.h"
#include "core/error.h"
#include "recording/events.h"
#include "recording/file_names.h"
#include "recording/recording.h"
#include "recording/replayed_wires.h"
#include "recording/tapped_wires.h"
#include "tests/recording/recorded_session.h"
#include "tests/support/no_alloc.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/small_disk.h"
#include "tests/support/temporary_folder.h"
#include "transport/virtual_can.h"

namespace {

bool no_locks = false;  // files lie where there are none, as in some file systems of networks

}  // namespace

/// In place of the C library's.
extern "C" int flock(int file, int how) noexcept {
  if (!no_locks) return static_cast<int>(::syscall(SYS_flock, file, how));
  errno = ENOLCK;
  return -1;
}

namespace knuckle::test {
namespace {

using recording::Recorder;
using recording::RecorderOptions;
using recording::RecorderStatus;
using recording::Recording;

std::vector<recording::Event> events_in(const std::vector<std::string>& files) {
  Recording recording(files);
  std::vector<recording::Event> events;
  while (const auto entry = recording.next()) {
    if (entry->topic != recording::Topic::kEvents) continue;
    if (auto event = recording::decode_log(entry->data, recording.head().started_unix_ns)) events.push_back(*event);
  }
  return events;
}

/// A child that records is killed once it has come so far. @return how far it had come, as it says itself.
double record_until_killed(const std::string& folder, double until_s) {
  auto* const drained_s = static_cast<volatile double*>(
      ::mmap(nullptr, sizeof(double), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  *drained_s = 0;
  const pid_t child = ::fork();
  if (child == 0) {
    RecordedSession recorded(short_session("wall_contact", 600), into(folder));
    for (;;) {
      recorded.session.step();
      recorded.recorder.drain();
      *drained_s = recorded.session.elapsed_s();
    }
  }
  while (*drained_s < until_s && ::waitpid(child, nullptr, WNOHANG) == 0) ::usleep(100);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  const double reached_s = *drained_s;
  ::munmap(const_cast<double*>(drained_s), sizeof(double));
  return reached_s;
}

TEST(Recorder, RecordingChangesNothingInTheSessionAndAllocatesNothingInItsSteps) {
  TemporaryFolder folder;
  const auto digest = [](bool recorded, const std::string& file) {
    const session::SimulateOptions options = short_session("wall_contact", 6);
    const session::LoadedSession loaded = session::load_session(options);
    RecorderOptions how;
    how.file = file;
    Recorder recorder(how, session::session_head(loaded.setup, options), loaded.setup.machine);
    session::Session session(loaded.setup);
    if (recorded) session.record_to(recorder);
    std::uint64_t allocations = 0;
    while (!session.done()) {
      const NoAllocScope scope;
      session.step();
      allocations += scope.allocations();
      recorder.drain();
    }
    EXPECT_EQ(allocations, 0u);
    const session::SessionOutcome outcome = session.take_outcome();
    return session::digest_of(outcome.record.samples, outcome.frames).whole;
  };
  EXPECT_EQ(digest(true, folder.file("a.mcap")), digest(false, folder.file("b.mcap")));
}

TEST(Recorder, FileThatWasNamedIsThereOnlyOnceItIsComplete) {
  TemporaryFolder folder;
  RecorderOptions how;
  how.file = folder.file("x.mcap");
  bool early = false, partial = false;
  (void)record(short_session("free_motion", 2), how, [&](session::Session&) {
    early = early || std::filesystem::exists(how.file);
    partial = partial || std::filesystem::exists(how.file + ".partial");
  });
  EXPECT_FALSE(early);
  EXPECT_TRUE(partial);
  EXPECT_TRUE(std::filesystem::exists(how.file));
  EXPECT_EQ(folder.count(), 1);
  EXPECT_TRUE(Recording({how.file}).complete());
}

TEST(Recorder, PartsFollowEachOtherAndRunAgainAsOne) {
  TemporaryFolder folder;
  RecorderOptions how = into(folder.path().string());
  how.part = 3s;
  const RecorderStatus status = record(short_session("wall_contact", 10), how);
  EXPECT_EQ(status.problem, "");
  EXPECT_EQ(status.steps_lost, 0u);
  const auto parts = paths_in(folder.path().string(), false);
  ASSERT_EQ(parts.size(), 4u);
  const recording::ReplayResult result = replayed(parts);
  EXPECT_TRUE(result.identical());
  EXPECT_EQ(result.sides[0].steps, 10'000u);
  EXPECT_EQ(result.sides[1].steps, 2'000u);
  EXPECT_THROW(Recording({parts[0], parts[2]}), InputError);  // one is missing
  EXPECT_THROW((void)replayed({parts[1]}), InputError);       // begins in the middle
}

TEST(Recorder, OtherFilesInTheFolderAreLeftAlone) {
  TemporaryFolder folder;
  std::vector<std::string> others;
  for (const char* name : {"holiday_part1.mcap", "2026-notes.txt", "2019-06-01_survey_of_a_colleague.mcap"}) {
    others.push_back(folder.file(name));
    std::ofstream(others.back()) << std::string(10'000, 'x');
  }
  const std::string live = folder.file("2026-11-25T10-00-00Z_master_part001.mcap");  // of a program that runs beside
  mcap::FileWriter beside;
  ASSERT_TRUE(beside.open(live, recording::topics()));
  RecorderOptions how = into(folder.path().string());
  how.part = 1s;
  how.folder_bytes = 1;
  (void)record(short_session("free_motion", 3), how);
  EXPECT_TRUE(std::filesystem::exists(live));
  ASSERT_TRUE(beside.close());
  const RecorderStatus status = record(short_session("free_motion", 2), how);
  EXPECT_FALSE(std::filesystem::exists(live));
  ASSERT_FALSE(status.notices.empty());
  EXPECT_EQ(status.notices[0], "deleted, as the folder is full: " + live);
  for (const std::string& other : others) EXPECT_TRUE(std::filesystem::exists(other)) << other;
}

/// A part of an earlier session, as it stands in the folder. @param ahead of the clock.
std::string put_part(const TemporaryFolder& folder, const std::string& name, std::chrono::seconds ahead) {
  std::string path = folder.file(name + "_slave_part001.mcap");
  std::ofstream(path) << std::string(600'000, 'x');
  std::filesystem::last_write_time(path, std::filesystem::file_time_type::clock::now() + ahead);
  return path;
}

TEST(Recorder, NewestRecordingsStayWhereTheClockIsBehindThoseThatAreThere) {
  TemporaryFolder folder;
  constexpr auto kYears = std::chrono::seconds(std::chrono::years(50));  // boards without a battery begin in 1970
  const std::string first = put_part(folder, "2076-11-25T10-00-00Z", kYears),
                    second = put_part(folder, "2076-11-25T11-00-00Z", kYears + 1h);
  RecorderOptions how = into(folder.path().string());
  how.part = 1s;
  how.folder_bytes = 2'000'000;
  std::string newest;
  for (int session = 0; session < 4; ++session) {
    const RecorderStatus status = record(short_session("free_motion", 3), how);
    std::uint64_t total = 0;
    const auto files = recording::files_in(folder.path().string());
    for (const auto& file : files) total += file.bytes;
    EXPECT_LE(total, how.folder_bytes + 600'000) << "and the part that was written last";
    ASSERT_FALSE(files.empty());
    EXPECT_EQ(files.back().path, status.file) << "session " << session;
    EXPECT_TRUE(newest.empty() || std::filesystem::exists(newest)) << "the end of the session before is gone";
    newest = status.file;
  }
  EXPECT_FALSE(std::filesystem::exists(first)) << "the oldest";
  EXPECT_FALSE(std::filesystem::exists(second));
}

TEST(Recorder, RecordingOfAKilledProgramIsTheNewestAlsoWhereTheClockIsBehind) {
  TemporaryFolder folder;
  const std::string old = put_part(folder, "2076-11-25T10-00-00Z", std::chrono::seconds(std::chrono::years(50)));
  ASSERT_GT(record_until_killed(folder.path().string(), 1), 0);
  const auto files = recording::files_in(folder.path().string());
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files.front().path, old);
  EXPECT_EQ(recording::make_room(folder.path().string(), files.back().bytes), std::vector{old});
  EXPECT_EQ(recording::make_room(folder.path().string(), 0), std::vector{files.back().path}) << "its lock has ended";
}

/// While one lives, files may keep this program out: it is not root.
class WithoutRights {
 public:
  WithoutRights() {
    constexpr uid_t kNobody = 65534;
    if (root_ && seteuid(kNobody) != 0) ADD_FAILURE() << "still root";
  }
  ~WithoutRights() {
    if (root_ && seteuid(0) != 0) ADD_FAILURE() << "not root again";
  }
  WithoutRights(const WithoutRights&) = delete;
  WithoutRights& operator=(const WithoutRights&) = delete;

 private:
  bool root_ = geteuid() == 0;
};

TEST(Recorder, AFileThatMayNotBeOpenedIsDeletedInItsTurnAndStaysWhileItIsAboutAsNewAsTheNewest) {
  TemporaryFolder folder;
  const std::string path = folder.path().string();
  std::filesystem::permissions(path, std::filesystem::perms::all);
  constexpr auto kYears = std::chrono::seconds(std::chrono::years(50));  // the clock is behind
  const std::string closed = put_part(folder, "2026-11-25T10-00-00Z", -2h),
                    old = put_part(folder, "2076-11-25T10-00-00Z", kYears - 1h),
                    written = put_part(folder, "2076-11-25T11-00-00Z", kYears),  // another account's, that goes on
      newest = put_part(folder, "2076-11-25T11-00-02Z", kYears + 2s);
  for (const std::string& file : {closed, written}) std::filesystem::permissions(file, std::filesystem::perms::none);
  const WithoutRights nobody;
  ASSERT_FALSE(std::ifstream(closed).is_open());
  EXPECT_EQ(recording::make_room(path, 3 * 600'000), std::vector{closed});
  EXPECT_EQ(recording::make_room(path, 0), (std::vector{old, newest}));
  EXPECT_TRUE(std::filesystem::exists(written));
}

TEST(Recorder, WhatIsBeingWrittenStaysAlsoWhereThereAreNoLocks) {
  TemporaryFolder folder;
  const std::string old = put_part(folder, "2026-11-25T10-00-00Z", -2h);
  RecorderOptions how = into(folder.path().string());
  how.folder_bytes = 1;
  no_locks = true;
  const RecorderStatus status = record(short_session("free_motion", 3), how);
  no_locks = false;
  EXPECT_FALSE(std::filesystem::exists(old));
  EXPECT_EQ(status.problem, "");
  EXPECT_EQ(paths_in(folder.path().string(), false), std::vector{status.file});
  EXPECT_EQ(status.notices, std::vector{"deleted, as the folder is full: " + old});
}

TEST(Recorder, EveryProgramThatRecordsCountsInTheFolder) {
  TemporaryFolder folder;
  for (const char* program : {"slave", "master", "console", "simulate", "commission", "recover"}) {
    recording::Head head;
    head.program = std::string("knuckle ") + program + " --can can0";
    std::ofstream(folder.file(recording::part_name(head, 1))) << "x";
  }
  EXPECT_EQ(recording::files_in(folder.path().string()).size(), 6u);
}

TEST(Recorder, FullDiskEndsTheRecordingAndNothingElse) {
  SmallDisk disk(1'500'000);
  if (!disk.mounted()) GTEST_SKIP() << "NOT TESTED: full disks: may not mount one";
  int ticks = 0;
  const RecorderStatus status =
      record(short_session("wall_contact", 20), into(disk.path()), [&](session::Session&) { ++ticks; });
  EXPECT_EQ(ticks, 20'000);
  EXPECT_FALSE(status.recording);
  EXPECT_EQ(status.problem, "No space left on device");
  const auto parts = paths_in(disk.path(), false);
  ASSERT_EQ(parts.size(), 1u);
  Recording recording(parts);
  std::uint64_t entries = 0;
  std::string last_event;
  while (const auto entry = recording.next()) {
    ++entries;
    if (entry->topic == recording::Topic::kEvents) last_event = recording::decode_log(entry->data, 0).value().text;
  }
  EXPECT_GT(entries, 5000u);
  EXPECT_TRUE(recording.damages().empty());
  EXPECT_FALSE(recording.complete()) << "what is missing is not taken for nothing";
  EXPECT_EQ(last_event, "the recording has ended: No space left on device");
}

TEST(Recorder, FlightRecordThatTheDiskCutOffIsNotTakenForAWholeOne) {
  SmallDisk disk(1'500'000);
  if (!disk.mounted()) GTEST_SKIP() << "NOT TESTED: full disks: may not mount one";
  RecorderOptions how = into(disk.path());
  how.keep = false;
  how.least_free_bytes = 0;
  const RecorderStatus status = record(short_session("bus_faults", 20), how);
  EXPECT_TRUE(status.flights.empty());
  ASSERT_FALSE(status.notices.empty());
  EXPECT_TRUE(says(status.notices[0], "could not be written: No space left on device"));
  const std::set<std::string> different(status.notices.begin(), status.notices.end());
  EXPECT_EQ(different.size(), status.notices.size()) << "nothing is said twice";
  const auto files = paths_in(disk.path(), true);
  ASSERT_FALSE(files.empty());
  Recording recording({files.front()});
  while (recording.next()) {
  }
  EXPECT_FALSE(recording.complete());
  EXPECT_TRUE(says(recording::defects(recording).back(), "the disk refused the rest"));
}

TEST(Recorder, StopsBeforeTheDiskIsFullAndDeletesNothingOfAProgramThatRuns) {
  SmallDisk disk(4'000'000);
  if (!disk.mounted()) GTEST_SKIP() << "NOT TESTED: full disks: may not mount one";
  RecorderOptions how = into(disk.path());
  how.least_free_bytes = 2'500'000;  // of so small a disk, a tenth counts: 400 kB
  const std::string live = disk.path() + "/1970-01-01T00-00-00Z_master_part001.mcap";  // begun in the same second
  mcap::FileWriter beside;
  ASSERT_TRUE(beside.open(live, recording::topics()));
  const RecorderStatus status = record(short_session("wall_contact", 20), how);
  EXPECT_EQ(status.problem, "only 0 MiB are left on the disk");
  EXPECT_GT(recording::free_bytes(disk.path()).value_or(0), 100'000u);
  EXPECT_LT(recording::free_bytes(disk.path()).value_or(0), 400'000u);
  EXPECT_TRUE(std::filesystem::exists(live));
}

TEST(Recorder, FolderThatCannotBeWrittenIsRefusedInOneLine) {
  TemporaryFolder folder;
  std::ofstream(folder.file("file")) << "x";
  const auto act = [&] { (void)record(short_session("free_motion", 1), into(folder.file("file") + "/inside")); };
  EXPECT_TRUE(says(refusal(act), "Not a directory"));
}

TEST(Recorder, StepsThatHaveNoRoomAreCountedAndTheReplayNamesThem) {
  TemporaryFolder folder;
  RecorderOptions how;
  how.file = folder.file("x.mcap");
  how.ring_bytes = std::size_t{1} << 17;
  RecordedSession recorded(short_session("wall_contact", 4), how);
  auto& [recorder, session] = recorded;
  while (!session.done()) {  // the recorder sleeps for most of the session
    session.step();
    if (session.elapsed_s() < 1 || session.elapsed_s() > 3) recorder.drain();
  }
  recorder.close();
  EXPECT_GT(recorder.status().steps_lost, 0u);
  const recording::ReplayResult result = replayed({how.file});
  EXPECT_EQ(result.sides[0].missing + result.sides[1].missing, recorder.status().steps_lost);
  ASSERT_TRUE(result.sides[0].first);
  EXPECT_TRUE(says(result.sides[0].first->what[0], "are missing in the recording"));
  std::string events;
  for (const recording::Event& event : events_in({how.file})) events += event.text + '\n';
  EXPECT_TRUE(says(events, "are missing: the recorder was too slow"));
}

TEST(Replay, OfWhatCannotBeReadIsNotIdentical) {
  TemporaryFolder folder;
  RecorderOptions how;
  how.file = folder.file("x.mcap");
  (void)record(short_session("free_motion", 2), how);
  std::filesystem::resize_file(how.file, 40'000);  // within its first chunk
  EXPECT_FALSE(replayed({how.file}).identical());
}

TEST(Replay, AWireThatChangesItsStateWithinAStepIsAskedTheSameAgain) {
  VirtualCanBus bus(2, 500'000);
  ByteRing ring(1 << 16);
  recording::LoopTap tap;
  tap.record_to(ring);
  recording::TappedCan tapped(bus.port(0), tap);
  const CanState before = tapped.state();
  bus.take_down(0, true);
  const CanState after = tapped.state();
  ASSERT_NE(before, after);
  tap.end_step({}, ReasonCode::kNone);
  recording::StepHeader header;
  std::memcpy(&header, ring.front().data(), sizeof header);
  const auto wires = recording::decode_wires(ring.front().subspan(sizeof header, header.wires_size), kLinkVersion);
  ASSERT_TRUE(wires);
  recording::ReplayedWires replayed;
  replayed.begin(*wires);
  EXPECT_EQ(replayed.can().state(), before);
  EXPECT_EQ(replayed.can().state(), after);
  EXPECT_TRUE(replayed.end().empty());
}

void expect_killed_recordings_open(int kills, unsigned seed) {
  std::mt19937 random(seed);
  int opened = 0;
  for (int i = 0; i < kills; ++i) {
    TemporaryFolder folder;
    const double until_s = std::uniform_real_distribution<double>(0, 12)(random);
    const double reached_s = record_until_killed(folder.path().string(), until_s);
    const auto parts = paths_in(folder.path().string(), false);
    if (reached_s < 1.5) continue;  // killed before it had anything to keep
    ASSERT_EQ(parts.size(), 1u) << "after " << until_s << " s";
    Recording recording(parts);
    recording::Replay run(recording::setup_of(recording));
    while (const auto entry = recording.next()) run.take(*entry);
    for (const std::string& damage : recording.damages())
      EXPECT_TRUE(says(damage, "cut off")) << "killed while it wrote";
    EXPECT_TRUE(run.result().identical());
    EXPECT_FALSE(recording.complete());
    ASSERT_TRUE(recording.span());
    EXPECT_GE(to_seconds(recording.span()->last), reached_s - 1) << "after " << until_s << " s";
    ++opened;
  }
  EXPECT_GE(opened, kills / 3);
}

TEST(Recorder, KilledProgramLeavesARecordingUpToItsLastSecond) {
  expect_killed_recordings_open(6, 11);
}
TEST(DeepRecorder, KilledProgramLeavesARecordingUpToItsLastSecondWheneverItIsKilled) {
  expect_killed_recordings_open(50, 12);
}

}  // namespace
}  // namespace knuckle::test
