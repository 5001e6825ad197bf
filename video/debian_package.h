// Where a part of GStreamer that is missing comes from.
#pragma once

#include <string>
#include <string_view>

namespace knuckle::video {

/// The package of Debian that has it; empty where it is none that Knuckle uses or its documentation names.
/// @param part an element ("x264enc"), or what a pipeline misses, as GStreamer tells an installer of plugins
/// ("gstreamer|1.0|knuckle|H.264 decoder|decoder-video/x-h264, level=...")
[[nodiscard]] std::string debian_package_of(std::string_view part);

}  // namespace knuckle::video
