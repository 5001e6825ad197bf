// `knuckle slave --camera`: what it refuses, and that its pictures arrive.
#include "app/programs/slave_cameras.h"

#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "core/error.h"
#include "machine/load.h"
#include "tests/support/free_address.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "video/camera.h"

namespace knuckle::programs {
namespace {

constexpr const char* kCamera = "mast=videotestsrc is-live=true ! video/x-raw,width=320,height=180,framerate=30/1";

std::string camera_refusal(const CameraOptions& options, int insecure = 0, const std::string& listen = "") {
  return test::refusal([&] { return check_cameras(options, insecure, listen); });
}

TEST(SlaveCameraOptions, GiveEachCameraAPortOfItsOwn) {
  EXPECT_TRUE(check_cameras({}, 0, "").empty());
  const auto setups = check_cameras({{kCamera, "rear=videotestsrc"}, "127.0.0.1:5700", 3000}, 0, "");
  ASSERT_EQ(setups.size(), 2u);
  EXPECT_EQ(setups[0].camera.name, "mast");
  EXPECT_EQ(setups[0].port, 5700);
  EXPECT_EQ(setups[1].port, 5701);
  EXPECT_EQ(setups[1].host, "127.0.0.1");
  EXPECT_EQ(setups[1].rate_kbps, 3000);
}

TEST(SlaveCameraOptions, SendNothingInTheClearIntoANetworkUnlessThatWasSaidTwice) {
  EXPECT_TRUE(test::says(camera_refusal({{kCamera}, "192.0.2.1:5700"}, 1), "not encrypted"));
  EXPECT_EQ(camera_refusal({{kCamera}, "192.0.2.1:5700"}, 2), "accepted");
  EXPECT_EQ(camera_refusal({{kCamera}, "[::1]:5700"}, 1), "accepted");
}

TEST(SlaveCameraOptions, SealPicturesWhereverTheyGoUnlessTheLinkIsPlain) {
  for (const char* to : {"192.0.2.1:5700", "127.0.0.1:5700"})
    EXPECT_TRUE(check_cameras({{kCamera}, to, 3000}, 0, "").at(0).sealed) << to;
  EXPECT_FALSE(check_cameras({{kCamera}, "127.0.0.1:5700", 3000}, 1, "").at(0).sealed);
  EXPECT_FALSE(check_cameras({{kCamera}, "192.0.2.1:5700", 3000}, 2, "").at(0).sealed);
}

TEST(SlaveCameraOptions, TakeACameraOfTheSimulatedMachineThatItsFileKnows) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const CameraOptions mast{{"mast=simulated"}, "127.0.0.1:5700", 3000},
      rear{{"rear=simulated"}, "127.0.0.1:5700", 3000};
  EXPECT_TRUE(test::says(check_cameras(mast, 1, "", &machine).at(0).camera.source, "appsrc"));
  EXPECT_TRUE(test::says(camera_refusal(mast, 1), "--camera mast=simulated: a simulated camera goes with --simulate"));
  EXPECT_THROW((void)check_cameras(rear, 1, "", &machine), InputError);
}

TEST(SlaveCameraOptions, AreRefusedInOneLine) {
  EXPECT_TRUE(test::says(camera_refusal({{kCamera}, ""}), "--camera: needs --video-to"));
  EXPECT_TRUE(test::says(camera_refusal({{}, "127.0.0.1:5700"}), "--video-to 127.0.0.1:5700: needs --camera"));
  EXPECT_TRUE(test::says(camera_refusal({{kCamera}, "127.0.0.1"}), "--video-to"));
  EXPECT_TRUE(test::says(camera_refusal({{kCamera, kCamera}, "127.0.0.1:65535"}), "no port for each"));
  EXPECT_TRUE(test::says(camera_refusal({{kCamera, kCamera}, "127.0.0.1:5700"}), "--camera mast: is given twice"));
  EXPECT_TRUE(test::says(camera_refusal({{kCamera}, "127.0.0.1:5700", 100}),
                         "--video-kbps 100: must be from 200 to 50000 kbit/s"));
  EXPECT_TRUE(test::says(camera_refusal({{kCamera, "rear=videotestsrc"}, "127.0.0.1:5700"}, 0, "127.0.0.1:5701"),
                         "a camera's pictures would go to port 5701, which is --listen's"));
  EXPECT_EQ(camera_refusal({{kCamera}, "127.0.0.1:5700"}, 0, "127.0.0.1:5701"), "accepted");
  EXPECT_TRUE(test::says(camera_refusal({{"mast=nosuchsrc"}, "127.0.0.1:5700"}), "no element"));
  EXPECT_TRUE(test::says(camera_refusal({{"mast=videotestsrc ! jpegenc"}, "127.0.0.1:5700"}), "end in pictures"));
}

TEST(SlaveCameraPictures, SayOnceWhatIsWrongWithACamera) {
  SlaveCameras cameras({{{"mast", "v4l2src device=/dev/video97"}, "127.0.0.1", 9, 1000}});
  std::vector<cli::News> all;
  for (int i = 0; i < 200; ++i, std::this_thread::sleep_for(10ms))  // it tries again meanwhile
    for (cli::News& news : cameras.news()) all.push_back(news);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_TRUE(test::says(all[0].what, "camera mast: ") && test::says(all[0].what, "/dev/video97")) << all[0].what;
}

TEST(SlaveCameraPictures, ArriveFromTheSimulatedMachinesMast) {
  const std::uint16_t port = test::free_port();
  video::Camera camera({"mast", video::receiver_of(port)});
  test::RunningProgram program(
      test::program("knuckle"),
      {"slave", "--simulate", "--scenario", "wall_contact", "--insecure", "--no-log", "--listen", "127.0.0.1:0",
       "--camera", "mast=simulated", "--video-to", "127.0.0.1:" + std::to_string(port), "--duration", "300"});
  std::unique_ptr<video::Frame> frame;
  while (!(frame = camera.take()) && !program.ends_within(10ms)) {
  }
  ASSERT_NE(frame, nullptr) << camera.status().why.data();
  EXPECT_EQ(frame->width_px, kDrawnWidth_px);
  EXPECT_EQ(frame->stamp_from, video::StampFrom::kSender);
  // Not one colour: something is drawn.
  int least = 255, most = 0;
  for (int i = 0; i < frame->height_px; i += 8) {
    const int red = frame->pixels[std::ptrdiff_t{i} * frame->row_bytes + std::ptrdiff_t{4} * frame->width_px / 2];
    least = std::min(least, red);
    most = std::max(most, red);
  }
  EXPECT_GT(most - least, 50);
  program.signal(SIGTERM);  // killed, it would last for as long as the idle threads of OpenGL on a busy computer
  EXPECT_EQ(program.wait().exit_code, 0);
}

}  // namespace
}  // namespace knuckle::programs
