// The console as a program, paired with the machine's side: it shows the sealed pictures of each session there is.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tests/console/window/screen_pixel.h"
#include "tests/console/window/virtual_display.h"
#include "tests/support/free_address.h"
#include "tests/support/paired_computers.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"
#include "tests/video/patience.h"
#include "transport/udp_link.h"

namespace knuckle::test {
namespace {

using video::comes;

TEST(PairedConsoleThreads, ShowsTheSealedPicturesOfItsSessionAndOfTheOneAfterIt) {
  const console::window::VirtualDisplay display("1280x800");
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  const TemporaryFolder folder;
  pair_computers(folder.file("machine"), folder.file("desk"), "desk 1");
  const std::string link = free_address(), pictures = free_address();
  const auto machine = [&] {
    return std::make_unique<RunningProgram>(
        program("knuckle"),
        std::vector<std::string>{"slave", "--simulate", "--no-log", "--listen", link, "--keys", folder.file("machine"),
                                 "--camera", "mast=videotestsrc is-live=true pattern=red", "--video-to", pictures});
  };
  auto first = machine();
  const RunningProgram console(
      program("knuckle"),
      std::vector<std::string>{"console", "--no-log", "--mute", "--connect", link, "--machine", "solar015", "--keys",
                               folder.file("desk"), "--camera", "mast=knuckle:" + pictures});
  const console::window::ScreenPixel in_picture(400, 300);  // of the camera's
  const auto red = [&] {
    const auto [r, g, b] = in_picture.look();
    return r > 200 && g < 60 && b < 60;
  };
  ASSERT_TRUE(comes(red)) << "pictures of the first session";
  first.reset();  // killed
  ASSERT_TRUE(comes([&] { return !red(); })) << "not live";
  const auto second = machine();
  EXPECT_TRUE(comes(red)) << "pictures of another session, with other keys";
}

}  // namespace
}  // namespace knuckle::test
