// --camera NAME=SOURCE.
#include "video/source.h"

#include <gtest/gtest.h>

#include <utility>

#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "video/gst_owned.h"

namespace knuckle::video {
namespace {

TEST(CameraSource, IsANameAndWhatFollowsTheFirstEqualsSign) {
  const CameraSource source = parse_source("mast=videotestsrc pattern=ball");
  EXPECT_EQ(source.name, "mast");
  EXPECT_EQ(source.source, "videotestsrc pattern=ball");
}

TEST(CameraSource, LetsNoLibraryBelowItWriteToTheTerminal) {
  start_gstreamer();
  testing::internal::CaptureStderr();
  g_log("libsoup", G_LOG_LEVEL_WARNING, "a line of its own");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(CameraSource, IsAPipelineOrAUriAndElseRefusedWithWhatIsWrong) {
  const std::pair<const char*, const char*> kSources[]{
      {"a=videotestsrc", "accepted"},
      {"a=videotestsrc ! identity", "accepted"},
      {"a=rtsp://192.0.2.1/live?x=\"y\"", "accepted"},
      {"a=v4l2:///dev/video0", "accepted"},
      {"a=file:///none.mp4", "accepted"},
      {"a=udpsrc port=5000 ! decodebin", "accepted"},
      {"videotestsrc", "must be NAME=SOURCE"},
      {"videotestsrc pattern=ball", "must be NAME=SOURCE"},
      {"=videotestsrc", "must be NAME=SOURCE"},
      {"mast=", "must be NAME=SOURCE"},
      {"rtsp://a/b?c=d", "must be NAME=SOURCE"},
      {"mast=nosuchsrc ! decodebin", "--camera mast=nosuchsrc ! decodebin: no element \"nosuchsrc\""},
      {"mast=videotestsrc ! jpegenc", "end in pictures (video/x-raw)"},
      {"mast=videotestsrc patern=ball", "no property \"patern\""},
      {"mast=videotestsrc ! !", "must be a URI or a pipeline"},
      {"mast=rtsp:/192.0.2.9/live", "two slashes must follow "},
      {"mast=rtsp:192.0.2.9", "two slashes must follow "},
      {"mast=v4l2:/dev/video0", "two slashes must follow "},
      {"mast=gopher://a/b", "no GStreamer plugin on this computer reads gopher://"}};
  for (const auto& [text, said] : kSources)
    EXPECT_TRUE(test::says(test::refusal([&, &source = text] { check_source(parse_source(source)); }), said)) << text;
}

}  // namespace
}  // namespace knuckle::video
