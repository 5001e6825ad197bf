#include "video/debian_package.h"

#include <array>
#include <utility>

namespace knuckle::video {
namespace {

/// Elements, then what decodebin and uridecodebin look for; a space around each.
constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kPackages{
    {{"gstreamer1.0-plugins-base",
      " appsink appsrc audioconvert audioresample decodebin uridecodebin videoconvert videoscale videotestsrc "},
     {"gstreamer1.0-plugins-good",
      " autoaudiosink jpegdec jpegenc rtph264depay rtph264pay rtph265depay rtpjitterbuffer rtpjpegdepay rtspsrc udpsink"
      " udpsrc v4l2src decoder-application/x-rtp decoder-image/jpeg urisource-rtsp urisource-udp urisource-v4l2 "},
     {"gstreamer1.0-plugins-bad", " h264parse h265parse srtpdec srtpenc "},
     {"gstreamer1.0-plugins-ugly", " x264enc "},
     {"gstreamer1.0-libav", " avdec_h264 avdec_h265 decoder-video/x-h264 decoder-video/x-h265 "},
     {"gstreamer1.0-alsa", " alsasink "}}};

}  // namespace

std::string debian_package_of(std::string_view part) {
  if (const std::size_t bar = part.rfind('|'); bar != std::string_view::npos) {
    part = part.substr(bar + 1);
    part = part.substr(0, part.find(','));
    constexpr std::string_view kElement = "element-";
    if (part.starts_with(kElement)) part.remove_prefix(kElement.size());
  }
  for (const auto& [package, parts] : kPackages) {
    if (parts.find(" " + std::string(part) + " ") != std::string_view::npos) return std::string(package);
  }
  return {};
}

}  // namespace knuckle::video
