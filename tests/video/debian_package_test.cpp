// What is missing of GStreamer is told with the package that has it.
#include <gst/pbutils/missing-plugins.h>
#include <gtest/gtest.h>

#include "tests/video/patience.h"
#include "video/gst_owned.h"
#include "video/pipeline_runner.h"
#include "video/source.h"

namespace knuckle::video {
namespace {

TEST(DebianPackage, IsTheOneWhoseSourceTheInstalledElementIsMadeFrom) {
  start_gstreamer();
  const std::pair<const char*, const char*> sources[] = {{"x264enc", "gst-plugins-ugly"},
                                                         {"avdec_h264", "gst-libav"},
                                                         {"h264parse", "gst-plugins-bad"},
                                                         {"rtspsrc", "gst-plugins-good"},
                                                         {"uridecodebin", "gst-plugins-base"}};
  for (const auto& [element, source] : sources) {
    const std::string package = debian_package_of(element);
    EXPECT_EQ(package.substr(sizeof("gstreamer1.0-") - 1), std::string(source).substr(sizeof("gst-") - 1)) << element;
    const Owned<GstElementFactory> factory(gst_element_factory_find(element));
    if (!factory) continue;  // cameras of a real machine are optional on a computer that builds
    const Owned<GstPlugin> plugin(gst_plugin_feature_get_plugin(GST_PLUGIN_FEATURE(factory.get())));
    EXPECT_STREQ(gst_plugin_get_source(plugin.get()), source) << element;
  }
}

TEST(DebianPackage, IsKnownOfWhatGStreamerAsksAnInstallerForAndNotGuessed) {
  for (const auto& [part, package] : std::initializer_list<std::pair<const char*, const char*>>{
           {"gstreamer|1.0|knuckle|RTSP protocol source|urisource-rtsp", "gstreamer1.0-plugins-good"},
           {"gstreamer|1.0|knuckle|GStreamer element x264enc|element-x264enc", "gstreamer1.0-plugins-ugly"},
           {"gstreamer|1.0|knuckle|H.265 decoder|decoder-video/x-h265, level=(string)4", "gstreamer1.0-libav"},
           {"", ""},
           {"x264", ""},
           {"x264encoder", ""},
           {"gstreamer|1.0|a|b|element-nosuchsrc", ""},
           {"x264enc ", ""}})
    EXPECT_EQ(debian_package_of(part), package) << part;
}

TEST(DebianPackage, IsNamedWhereAnElementIsMissing) {
  start_gstreamer();
  GstRegistry* registry = gst_registry_get();
  const Owned<GstPluginFeature> scaler(gst_registry_lookup_feature(registry, "videoscale"));
  gst_registry_remove_feature(registry, scaler.get());
  std::string told;
  EXPECT_EQ(make_pipeline("videotestsrc ! videoscale ! fakesink", told), nullptr);
  gst_registry_add_feature(registry, scaler.get());
  EXPECT_EQ(told, "no element \"videoscale\": install gstreamer1.0-plugins-base");
}

/// What is told of a pipeline that misses a decoder for this when it runs.
std::string told_of_missing(const char* caps) {
  PipelineRunner runner({.name = "camera front",
                         .description = "fakesrc ! fakesink",
                         .check = [] { return "nothing"; },
                         .prepare =
                             [caps](GstElement* pipeline) {
                               GstCaps* wanted = gst_caps_from_string(caps);
                               gst_element_post_message(pipeline, gst_missing_decoder_message_new(pipeline, wanted));
                               gst_caps_unref(wanted);
                               GST_ELEMENT_ERROR(pipeline, CORE, MISSING_PLUGIN, ("no decoder"), (nullptr));
                             },
                         .ready = {},
                         .tend = {}});
  CameraStatus status;
  EXPECT_TRUE(comes([&] { return runner.take(status) && status.troubles > 0; }));
  return status.why.data();
}

TEST(DebianPackage, IsNamedWhereADecoderIsMissing) {
  EXPECT_EQ(told_of_missing("video/x-h264"),
            "camera front: no H.264 decoder on this computer: install gstreamer1.0-libav; connecting again");
  EXPECT_EQ(
      told_of_missing("video/x-dirac"),
      "camera front: no Dirac decoder on this computer: install the GStreamer plugin that has it; connecting again");
}

}  // namespace
}  // namespace knuckle::video
