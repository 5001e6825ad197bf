// --camera NAME=SOURCE.
#include "video/source.h"

#include <gtest/gtest.h>

#include "tests/support/refusal.h"
#include "video/gst_owned.h"

namespace knuckle::video {
namespace {

std::string refusal(const std::string& text) {
  return test::refusal([&] { check_source(parse_source(text)); });
}

TEST(CameraSource, IsANameAndWhatFollowsTheFirstEqualsSign) {
  const CameraSource source = parse_source("mast=videotestsrc pattern=ball");
  EXPECT_EQ(source.name, "mast");
  EXPECT_EQ(source.source, "videotestsrc pattern=ball");
}

TEST(CameraSource, RefusesWhatHasNoName) {
  for (const char* text : {"videotestsrc", "videotestsrc pattern=ball", "=videotestsrc", "mast=", "rtsp://a/b?c=d"})
    EXPECT_NE(refusal(text).find("must be NAME=SOURCE"), std::string::npos) << text;
}

TEST(CameraSource, AcceptsPipelinesAndUris) {
  for (const char* text : {"a=videotestsrc", "a=videotestsrc ! identity", "a=rtsp://192.0.2.1/live?x=\"y\"",
                           "a=v4l2:///dev/video0", "a=file:///none.mp4", "a=udpsrc port=5000 ! decodebin"})
    EXPECT_EQ(refusal(text), "accepted") << text;
}

TEST(CameraSource, LetsNoLibraryBelowItWriteToTheTerminal) {
  start_gstreamer();
  testing::internal::CaptureStderr();
  g_log("libsoup", G_LOG_LEVEL_WARNING, "a line of its own");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(CameraSource, SaysWhichElementIsMissing) {
  EXPECT_EQ(
      refusal("mast=nosuchsrc ! decodebin"),
      "--camera mast=nosuchsrc ! decodebin: no element \"nosuchsrc\": is it spelt right, and the plugin that has it "
      "installed?");
}

TEST(CameraSource, SaysThatAPipelineDoesNotEndInPictures) {
  const std::string line = refusal("mast=videotestsrc ! jpegenc");
  EXPECT_NE(line.find("could not link"), std::string::npos) << line;
  EXPECT_NE(line.find("end in pictures (video/x-raw)"), std::string::npos) << line;
}

TEST(CameraSource, SaysWhatIsMisspelt) {
  EXPECT_NE(refusal("mast=videotestsrc patern=ball").find("no property \"patern\""), std::string::npos);
  EXPECT_NE(refusal("mast=videotestsrc ! !").find("must be a URI or a pipeline"), std::string::npos);
}

TEST(CameraSource, SaysThatTheSlashesOfAUriAreMissing) {
  for (const char* text : {"mast=rtsp:/192.0.2.9/live", "mast=rtsp:192.0.2.9", "mast=v4l2:/dev/video0"})
    EXPECT_NE(refusal(text).find(std::string("--camera ") + text + ": two slashes must follow "), std::string::npos)
        << text;
}

TEST(CameraSource, SaysThatNothingReadsAScheme) {
  EXPECT_NE(refusal("mast=gopher://a/b").find("no GStreamer plugin on this computer reads gopher://"),
            std::string::npos);
}

}  // namespace
}  // namespace knuckle::video
