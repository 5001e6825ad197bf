// What is said to a reader that stalls, leaves, or comes back; and to a disk that is full.
#include "app/cli/background_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "tests/support/stalled_pipe.h"

namespace knuckle::cli {
namespace {

using test::StalledPipe;

bool eventually(const std::function<bool()>& so) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!so()) {
    if (std::chrono::steady_clock::now() > give_up) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

BackgroundWriter::Deadline now() {
  return std::chrono::steady_clock::now();
}

TEST(BackgroundWriterThread, WritesAllThatItIsGivenInOrder) {
  const std::string file = testing::TempDir() + "background_" + std::to_string(getpid());
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  std::string wanted;
  {
    BackgroundWriter writer(descriptor);
    for (int i = 0; i < 20'000; ++i) {
      writer.stream() << "line " << i << '\n';
      if (i % 7 == 0) writer.stream().flush();
      wanted += "line " + std::to_string(i) + "\n";
    }
    writer.finish(now());  // a regular file gets the time that it needs
    EXPECT_EQ(writer.lines_lost(), 0U);
    EXPECT_EQ(writer.refusal(), 0);
  }
  close(descriptor);
  std::ifstream in(file);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), wanted);
  std::remove(file.c_str());
}

TEST(BackgroundWriterThread, NeitherWaitsForAReaderThatSleepsNorKeepsMoreThanItsBoundForIt) {
  StalledPipe pipe;
  pipe.fill();
  BackgroundWriter writer(pipe.writing_end(), BackgroundWriter::AfterRefusal::kGoOn, 1000);
  for (int i = 0; i < 100; ++i) writer.stream() << std::string(99, 'x') << '\n' << std::flush;
  EXPECT_GE(writer.lines_lost(), 100U - 2 * 10U) << "what waits, and what is under way";
  EXPECT_FALSE(writer.idle());
  writer.finish(now());
  EXPECT_EQ(writer.lines_lost(), 100U) << "what was never read counts, too";
}

TEST(BackgroundWriterThread, GoesOnWhereItsReaderGoesOn) {
  StalledPipe pipe;
  pipe.fill();
  BackgroundWriter writer(pipe.writing_end());
  writer.stream() << "one\n" << std::flush;
  writer.stream() << "two\n" << std::flush;
  std::string read = pipe.read_all();  // the writer may go on before the last of it is read
  EXPECT_TRUE(eventually([&] { return writer.idle(); }));
  read += pipe.read_all();
  EXPECT_EQ(read.substr(read.find_first_not_of('\0')), "one\ntwo\n");
  EXPECT_EQ(writer.lines_lost(), 0U);
}

TEST(BackgroundWriterThread, AReaderThatLeavesIsAnErrorAndNoSignal) {
  StalledPipe pipe;
  pipe.leave();
  BackgroundWriter writer(pipe.writing_end());
  writer.stream() << "one\n" << std::flush;
  EXPECT_TRUE(eventually([&] { return writer.refusal() == EPIPE; }));
  writer.stream() << "two\n" << std::flush;
  writer.finish();
  EXPECT_EQ(writer.lines_lost(), 2U);
}

TEST(BackgroundWriterThread, AFullDiskIsToldWhileItRuns) {
  const int full = open("/dev/full", O_WRONLY);
  BackgroundWriter writer(full);
  writer.stream() << "one\n" << std::flush;
  EXPECT_TRUE(eventually([&] { return writer.refusal() == ENOSPC; }));
  close(full);
}

TEST(BackgroundWriterThread, OneTextLargerThanItsBoundIsTakenWhole) {
  StalledPipe pipe;
  BackgroundWriter writer(pipe.writing_end(), BackgroundWriter::AfterRefusal::kStop, 10);
  writer.stream() << std::string(30'000, 'x') << '\n' << std::flush;
  EXPECT_TRUE(eventually([&] { return writer.idle(); }));
  EXPECT_EQ(pipe.read_all().size(), 30'001U);
  EXPECT_EQ(writer.lines_lost(), 0U);
}

}  // namespace
}  // namespace knuckle::cli
