#include "video/pipeline_runner.h"

#include <gst/pbutils/missing-plugins.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/text.h"
#include "video/frame.h"
#include "video/gst_owned.h"
#include "video/source.h"

namespace knuckle::video {
namespace {

constexpr Duration kLook = 50ms;  // how often the thread looks up from waiting
constexpr Duration kShortestWait = 500ms, kLongestWait = 4s;

constexpr guint kRtspBuffer_ms = 40;  // of an RTSP camera, where GStreamer's own 2 s would be useless

/// An RTSP camera keeps its pictures back for as short as it may, and tells when they were captured.
void on_source(GstElement* /*reader*/, GstElement* source, gpointer /*self*/) {
  GObjectClass* kind = G_OBJECT_GET_CLASS(source);
  if (g_object_class_find_property(kind, "drop-on-latency") == nullptr) return;
  g_object_set(source, "latency", kRtspBuffer_ms, "drop-on-latency", TRUE, nullptr);
  if (g_object_class_find_property(kind, "add-reference-timestamp-meta") != nullptr)
    g_object_set(source, "add-reference-timestamp-meta", TRUE, nullptr);
}

/// What to do where a plugin is missing.
std::string advice_on_missing(GstMessage* message) {
  const Owned<gchar> what(gst_missing_plugin_message_get_description(message));
  const Owned<gchar> detail(gst_missing_plugin_message_get_installer_detail(message));
  const std::string package = detail ? debian_package_of(detail.get()) : "";
  return "no " + std::string(what.get()) + " on this computer: install " +
         (package.empty() ? "the GStreamer plugin that has it" : package);
}

/// An error of GStreamer's as a person can act on it.
/// @param missing advice_on_missing() of what came before it, if anything did.
std::string advice(const GError& error, const char* details, const std::string& missing) {
  const std::string said = error.message;
  if (!missing.empty()) return missing;
  if (details != nullptr && std::strstr(details, "not-negotiated") != nullptr)
    return "the formats of the pipeline's elements do not fit: is the stream of the codec that it decodes?";
  if (error.domain == GST_RESOURCE_ERROR) return said + " Check that the camera is there, and the network";
  if (error.domain == GST_STREAM_ERROR) return said + " Check the stream's codec and the pipeline";
  return said;
}

}  // namespace

PipelineRunner::PipelineRunner(PipelinePlan plan) : plan_(std::move(plan)), thread_([this] { run(); }) {}

PipelineRunner::~PipelineRunner() {
  ending_ = true;
  thread_.join();
}

void PipelineRunner::run() {
  start_gstreamer();
  for (Duration pause = kShortestWait; !ending_;) {
    const std::uint64_t before = counted();
    const std::optional<std::string> failed = connect();
    if (!failed) return;
    if (counted() != before) pause = kShortestWait;
    tell(false, plan_.name + ": " + *failed + "; connecting again");
    wait(pause);
    pause = std::min(2 * pause, kLongestWait);
  }
}

std::optional<std::string> PipelineRunner::connect() {
  ++connection_;
  missing_.clear();
  std::string told;
  const Owned<GstElement> pipeline = make_pipeline(plan_.description, told);
  if (!pipeline) return told;
  // The system's clock, which is ours, whatever a source brings along.
  const Owned<GstClock> clock(gst_system_clock_obtain());
  gst_pipeline_use_clock(GST_PIPELINE(pipeline.get()), clock.get());
  const Owned<GstElement> reader(gst_bin_get_by_name(GST_BIN(pipeline.get()), "reader"));  // of a URI
  if (reader) g_signal_connect(reader.get(), "source-setup", G_CALLBACK(&on_source), nullptr);
  plan_.prepare(pipeline.get());
  gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
  std::optional<std::string> failed = watch(pipeline.get());
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
  return failed;
}

std::optional<std::string> PipelineRunner::watch(GstElement* pipeline) {
  const Owned<GstBus> bus(gst_element_get_bus(pipeline));
  std::uint64_t seen = counted();
  Time since = now();
  for (bool first = true; !ending_;) {
    const Owned<GstMessage> message(gst_bus_timed_pop(bus.get(), static_cast<GstClockTime>(kLook.count())));
    if (message && GST_MESSAGE_TYPE(message.get()) == GST_MESSAGE_ASYNC_DONE) {
      if (plan_.ready) plan_.ready(pipeline);
    } else if (message) {
      if (std::optional<std::string> problem = problem_of(message.get())) return problem;
    }
    if (plan_.tend) plan_.tend(pipeline);
    if (std::string problem = plan_.problem ? plan_.problem() : ""; !problem.empty()) return problem;
    if (plan_.refused && plan_.refused() != status_.refused) {
      status_.refused = plan_.refused();
      statuses_.put(status_);
    }
    if (seen != counted()) {
      if (first) tell(true, {});
      first = false;
      seen = counted();
      since = now();
    } else if (const Duration patience = first ? plan_.patience.first : plan_.patience.next; now() - since > patience) {
      return "no picture for " + std::to_string(patience / 1s) + " s: check " + plan_.check();
    }
  }
  return std::nullopt;
}

std::optional<std::string> PipelineRunner::problem_of(GstMessage* message) {
  if (gst_is_missing_plugin_message(message) != FALSE) missing_ = advice_on_missing(message);
  if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS) return "the stream has ended";
  if (GST_MESSAGE_TYPE(message) != GST_MESSAGE_ERROR) return std::nullopt;
  GError* said = nullptr;
  gchar* more = nullptr;
  gst_message_parse_error(message, &said, &more);
  const Owned<GError> error(said);
  const Owned<gchar> details(more);
  return advice(*error, details.get(), missing_);
}

void PipelineRunner::tell(bool playing, const std::string& why) {
  status_.playing = playing;
  if (!why.empty()) {
    ++status_.troubles;
    const std::string line = one_message(why);
    status_.why.fill(0);
    std::copy_n(line.begin(), std::min(line.size(), status_.why.size() - 1), status_.why.begin());
  }
  statuses_.put(status_);
}

void PipelineRunner::wait(Duration time) {
  for (const Time until = now() + time; now() < until && !ending_;) std::this_thread::sleep_for(kLook);
}

}  // namespace knuckle::video
