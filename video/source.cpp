#include "video/source.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <mutex>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/text.h"
#include "video/gst_owned.h"

namespace knuckle::video {
namespace {

// Only the newest picture is kept. It waits for when it is due until the source has turned out to be a live one.
constexpr const char* kEnd =
    " ! videoconvert ! video/x-raw,format=RGBx ! appsink name=pictures max-buffers=1 drop=true sync=true "
    "enable-last-sample=false";

bool is_uri(const CameraSource& source) {
  return gst_uri_is_valid(source.source.c_str()) != FALSE;
}

/// Libraries below GStreamer, such as that of http, write to standard error on their own; what matters of it comes as
/// the pipeline's error, which names the camera.
GLogWriterOutput keep_quiet(GLogLevelFlags level, const GLogField* fields, gsize count, gpointer /*none*/) {
  const bool fatal = (level & (G_LOG_LEVEL_ERROR | G_LOG_FLAG_FATAL)) != 0;
  return fatal ? g_log_writer_default(level, fields, count, nullptr) : G_LOG_WRITER_HANDLED;
}

/// What to do where a pipeline has an element that is not there.
std::string advice_on_missing(GstParseContext& context) {
  gchar** names = gst_parse_context_get_missing_elements(&context);
  const std::string package = names != nullptr && names[0] != nullptr ? debian_package_of(names[0]) : "";
  g_strfreev(names);
  return package.empty() ? ": is it spelt right, and the plugin that has it installed?" : ": install " + package;
}

/// For a message: which camera's option it is about.
std::string option_of(const CameraSource& source) {
  return "--camera " + source.name + "=" + shortened(source.source) + ": ";
}

}  // namespace

CameraSource parse_source(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string_view name = std::string_view(text).substr(0, equals);
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
  if (equals == std::string::npos || !plain || equals + 1 == text.size())
    throw InputError(
        "--camera " + shortened(text) +
        ": must be NAME=SOURCE, such as mast=rtsp://192.0.2.9/live or mast='v4l2src ! decodebin'; the name "
        "is made of letters, digits, - and _");
  return {std::string(name), text.substr(equals + 1), false};
}

std::string pictures_of(const CameraSource& source) {
  if (!is_uri(source)) return source.source;
  std::string uri = source.source;
  for (const std::string_view special : {"\\", "\""}) {
    for (std::size_t at = 0; (at = uri.find(special, at)) != std::string::npos; at += 2) uri.insert(at, "\\");
  }
  // Sound and subtitles stay undecoded.
  return "uridecodebin name=reader caps=video/x-raw expose-all-streams=false uri=\"" + uri + "\"";
}

std::string pipeline_of(const CameraSource& source) {
  return pictures_of(source) + kEnd;
}

void start_gstreamer() {
  static std::once_flag quiet;  // GLib takes it once
  std::call_once(quiet, [] { g_log_set_writer_func(&keep_quiet, nullptr, nullptr); });
  GError* failed = nullptr;
  if (gst_init_check(nullptr, nullptr, &failed) != FALSE) return;
  const Owned<GError> error(failed);
  throw InputError("--camera: GStreamer does not start: " + one_message(error ? error->message : "no reason given"));
}

Owned<GstElement> make_pipeline(const std::string& description, std::string& told) {
  GError* failed = nullptr;
  const std::unique_ptr<GstParseContext, decltype(&gst_parse_context_free)> context(gst_parse_context_new(),
                                                                                    &gst_parse_context_free);
  Owned<GstElement> pipeline(
      gst_parse_launch_full(description.c_str(), context.get(), GST_PARSE_FLAG_FATAL_ERRORS, &failed));
  const Owned<GError> error(failed);
  if (error) {
    told = one_message(error->message);
    if (error->code == GST_PARSE_ERROR_NO_SUCH_ELEMENT) told += advice_on_missing(*context);
    return nullptr;
  }
  gst_object_ref_sink(pipeline.get());
  return pipeline;
}

std::string complaint(GstMessage* message) {
  GError* error = nullptr;
  if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR)
    gst_message_parse_error(message, &error, nullptr);
  else
    gst_message_parse_warning(message, &error, nullptr);
  const Owned<GError> owned(error);
  return printable(error->message);
}

void check_source(const CameraSource& source) {
  start_gstreamer();
  const Owned<gchar> scheme(gst_uri_get_protocol(source.source.c_str()));
  if (is_uri(source) && !source.source.substr(source.source.find(':')).starts_with("://"))
    throw InputError(option_of(source) + "two slashes must follow " + scheme.get() +
                     ":, as in rtsp://192.0.2.9/live or v4l2:///dev/video0");
  if (is_uri(source) && gst_uri_protocol_is_supported(GST_URI_SRC, scheme.get()) == FALSE)
    throw InputError(option_of(source) + "no GStreamer plugin on this computer reads " + scheme.get() +
                     ":// (rtsp, rtp, udp, http, v4l2 and file are in gstreamer1.0-plugins-good and -base)");
  check_pipeline(source, pipeline_of(source));
}

void check_pipeline(const CameraSource& source, const std::string& pipeline) {
  start_gstreamer();
  std::string told;
  if (make_pipeline(pipeline, told)) return;
  const bool link = told.find("could not link") != std::string::npos;
  const bool missing = told.find("no element") != std::string::npos;
  throw InputError(option_of(source) + told +
                   (link ? ": the pipeline must fit together and end in pictures (video/x-raw): is a decoder such as "
                           "decodebin missing?"
                    : missing ? ""
                              : ": must be a URI or a pipeline as gst-launch-1.0 takes it"));
}

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
