// From a picture's capture to its place on screen: through the console's window, and through the same GStreamer
// pipeline alone, in turns. The sender is the same for both, on this computer, over RTP. Needs a display
// (scripts/glass-to-glass). glass_to_glass SECONDS: of each of three turns of either.
#include <epoxy/gl.h>
#include <fmt/format.h>
#include <gst/app/gstappsink.h>
#include <gst/gst.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <string>
#include <vector>

#include "app/console/picture/video_view.h"
#include "tests/console/window/canned_console.h"
#include "video/gst_owned.h"
#include "video/sender.h"

namespace knuckle {
namespace {

constexpr std::uint16_t kPort = 45790;
constexpr int kTurns = 3;
constexpr Duration kWarmUp = 2s;

/// Of a sender's stamp, by the same clock that it is made with.
double since_ms(Duration ntp) {
  const Duration unix_now = std::chrono::system_clock::now().time_since_epoch();
  return 1e3 * to_seconds(unix_now - (ntp - 2'208'988'800s));
}

video::SenderSetup setup() {
  return {{"test", "videotestsrc is-live=true pattern=smpte ! video/x-raw,width=1280,height=720,framerate=30/1"},
          "127.0.0.1",
          kPort,
          4000};
}

/// Of each picture: from its capture until it is there decoded, from there until it is taken, until the frame that it
/// is in is submitted, and until that is drawn; and the sum.
struct Hops {
  std::vector<double> arrived_ms, taken_ms, submitted_ms, drawn_ms, all_ms;
  void add(Duration ntp, Time received, Time taken, Time submitted, Time drawn) {
    const auto ms = [](Duration d) { return 1e3 * to_seconds(d); };
    all_ms.push_back(since_ms(ntp) - ms(video::now() - drawn));
    arrived_ms.push_back(all_ms.back() - ms(drawn - received));
    taken_ms.push_back(ms(taken - received));
    submitted_ms.push_back(ms(submitted - taken));
    drawn_ms.push_back(ms(drawn - submitted));
  }
};

/// The console as an operator has it, at 60 frames/s; until the whole frame that the picture is in is drawn.
void through_console(console::window::ConsoleWindow& console, Duration time, Hops& hops) {
  using namespace console;
  const video::Sender sender(setup());
  const ConsoleView view = window::canned_view();
  const LoopHealth loop = window::canned_loop();
  EventBook events;
  struct Taken {
    Duration ntp;
    Time received, at;
  };
  std::optional<Taken> taken;
  const CameraFeed camera = feed_of({"test", video::receiver_of(kPort)}, console.bell());
  console.cameras() = {};
  console.cameras().add({camera.name,
                         [&] {
                           auto frame = camera.newest();
                           if (frame && frame->stamp_from == video::StampFrom::kSender)
                             taken = {frame->captured.time_since_epoch(), frame->received, video::now()};
                           return frame;
                         },
                         camera.status});
  for (const Time begin = video::now(); video::now() - begin < time + kWarmUp;) {
    taken.reset();
    console.frame(view, loop, events, 0);
    const Time submitted = video::now();
    glFinish();
    const Time drawn = video::now();
    if (taken && drawn - begin > kWarmUp) hops.add(taken->ntp, taken->received, taken->at, submitted, drawn);
    console.show();  // and waits until the next frame is due
  }
  console.cameras() = {};
}

/// Pulled as soon as it is there, uploaded and drawn alone.
void through_gstreamer_alone(Duration time, Hops& hops) {
  const video::Sender sender(setup());
  std::string told;
  const auto pipeline =
      video::make_pipeline(video::pipeline_of(video::CameraSource{"test", video::receiver_of(kPort)}), told);
  const video::Owned<GstElement> sink(gst_bin_get_by_name(GST_BIN(pipeline.get()), "pictures"));
  g_object_set(sink.get(), "sync", FALSE, nullptr);
  gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
  console::picture::VideoView view;
  for (const Time begin = video::now(); video::now() - begin < time + kWarmUp;) {
    const video::Owned<GstSample> sample(gst_app_sink_try_pull_sample(GST_APP_SINK(sink.get()), 100 * GST_MSECOND));
    if (!sample) continue;
    const Time received = video::now();
    GstBuffer* buffer = gst_sample_get_buffer(sample.get());
    const auto* stamp = gst_buffer_get_reference_timestamp_meta(buffer, nullptr);
    GstMapInfo bytes;
    if (stamp == nullptr || gst_buffer_map(buffer, &bytes, GST_MAP_READ) == FALSE) continue;
    video::Frame frame;
    frame.width_px = 1280;
    frame.height_px = 720;
    frame.row_bytes = 4 * frame.width_px;
    frame.pixels = bytes.data;
    view.upload(frame);
    view.draw({.width_px = 602, .height_px = 339}, true);
    const Time submitted = video::now();
    glFinish();
    const Time drawn = video::now();
    gst_buffer_unmap(buffer, &bytes);
    if (drawn - begin > kWarmUp)
      hops.add(Duration(static_cast<std::int64_t>(stamp->timestamp)), received, received, submitted, drawn);
  }
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
}

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void run(Duration time) {
  video::start_gstreamer();
  console::window::ConsoleWindow console({}, console::window::canned_facts());
  console.show_world(console::window::canned_world());
  Hops here, alone;
  for (int turn = 0; turn < kTurns; ++turn) {
    through_console(console, time, here);
    through_gstreamer_alone(time, alone);
  }
  fmt::print("| p50, p99 in ms | console | GStreamer alone |\n| --- | --- | --- |\n");
  const auto row = [&](const char* hop, std::vector<double> Hops::*of) {
    const auto both = [](std::vector<double>& v) {
      return fmt::format("{:.1f}, {:.1f}", quantile(v, 0.5), quantile(v, 0.99));
    };
    fmt::print("| {} | {} | {} |\n", hop, both(here.*of), both(alone.*of));
  };
  row("capture, encoder, network, decoder", &Hops::arrived_ms);
  row("waiting to be taken", &Hops::taken_ms);
  row("texture, and the frame submitted", &Hops::submitted_ms);
  row("drawn", &Hops::drawn_ms);
  row("capture to screen", &Hops::all_ms);
  fmt::print("| pictures | {} | {} |\n| ratio | {:.2f}, {:.2f} | |\n", here.all_ms.size(), alone.all_ms.size(),
             quantile(here.all_ms, 0.5) / quantile(alone.all_ms, 0.5),
             quantile(here.all_ms, 0.99) / quantile(alone.all_ms, 0.99));
}

}  // namespace
}  // namespace knuckle

int main(int count, char** words) {
  knuckle::run(knuckle::from_seconds(count > 1 ? std::atof(words[1]) : 20));
}
