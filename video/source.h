// Where a camera's pictures come from, as it is given on the command line.
#pragma once

#include <string>
#include <string_view>

namespace knuckle::video {

struct CameraSource {
  std::string name;
  std::string source;  ///< A URI (rtsp://..., v4l2:///dev/video0), or a pipeline as gst-launch-1.0 takes it.
  bool given = false;  ///< Pictures come by Sender::give().
};

/// "NAME=SOURCE". @throws InputError, one line, where it is anything else.
[[nodiscard]] CameraSource parse_source(const std::string& text);

/// The source as a part of a pipeline: what comes out at its end are pictures.
[[nodiscard]] std::string pictures_of(const CameraSource& source);

/// The pipeline of a source as gst-launch-1.0 would take it, ended in an appsink named "pictures".
[[nodiscard]] std::string pipeline_of(const CameraSource& source);

/// That the source can be made into a pipeline at all; nothing of it runs, devices and addresses are not opened.
/// @throws InputError, one line: an element or plugin that is missing, a pipeline that is misspelt or does not end in
/// pictures.
void check_source(const CameraSource& source);

/// The same for a whole pipeline made of the source.
void check_pipeline(const CameraSource& source, const std::string& pipeline);

// Where a part of GStreamer that is missing comes from.

/// The package of Debian that has it; empty where it is none that Knuckle uses or its documentation names.
/// @param part an element ("x264enc"), or what a pipeline misses, as GStreamer tells an installer of plugins
/// ("gstreamer|1.0|knuckle|H.264 decoder|decoder-video/x-h264, level=...")
[[nodiscard]] std::string debian_package_of(std::string_view part);

}  // namespace knuckle::video
