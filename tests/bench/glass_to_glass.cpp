// From a picture's capture until it is seen on the screen: through the console's window, and through the same GStreamer
// pipeline with GStreamer's own windows at its end, in turns. The sender is the same for all, on this computer, over
// RTP; what looks at the screen is, too. Needs a display (scripts/glass-to-glass).
// glass_to_glass SECONDS: of each of three turns of each; and one through the console where 5 % of the packets are
// lost.
#include <fmt/format.h>
#include <gst/gst.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "tests/bench/screen_watch.h"
#include "tests/bench/stamped_pictures.h"
#include "tests/console/window/canned_console.h"
#include "tests/video/lossy_wire.h"
#include "video/gst_owned.h"
#include "video/sender.h"

namespace knuckle {
namespace {

constexpr std::uint16_t kPort = 45790;
constexpr int kTurns = 3;
constexpr Duration kWarmUp = 2s;
constexpr OnScreen kInConsole{112, 92, 602, 339};  // the camera large on Operate, in a window of 1280x800

double ms(Duration d) {
  return 1e3 * to_seconds(d);
}

/// Thirty stamped pictures a second, sent as a camera's.
class StampedSender {
 public:
  explicit StampedSender(std::uint16_t port)
      : sender_({video::given_pictures("test", StampedPictures::kWidth_px, StampedPictures::kHeight_px), "127.0.0.1",
                 port, 4000}),
        thread_([this] { run(); }) {}
  ~StampedSender() {
    ending_ = true;
    thread_.join();
  }
  StampedSender(const StampedSender&) = delete;
  StampedSender& operator=(const StampedSender&) = delete;
  [[nodiscard]] Time captured(std::uint32_t number) const { return pictures_.captured(number); }
  [[nodiscard]] std::uint64_t sent() const { return sender_.pictures(); }

 private:
  void run() {
    constexpr Duration kPeriod = Duration(1s) / StampedPictures::kFrames_per_s;
    for (Time next = video::now(); !ending_; next += kPeriod) {
      std::this_thread::sleep_until(std::chrono::steady_clock::time_point(next.time_since_epoch()));
      sender_.give(pictures_.next());
    }
  }
  StampedPictures pictures_;
  video::Sender sender_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

/// Of each picture: until it is there decoded, from there until it is taken, until the frame that it is in is drawn,
/// until that is seen on the screen; and the sum.
struct Hops {
  std::vector<double> decoded_ms, taken_ms, drawn_ms, seen_ms, all_ms;
  std::uint64_t sent = 0, damaged = 0;
  double longest_gap_ms = 0;  ///< Between one that is seen and the next.
};

/// What is known of the pictures of a turn, by their number.
class Log {
 public:
  struct Entry {
    Time decoded = kNever, taken = kNever, drawn = kNever, seen = kNever;
  };
  void note(std::uint32_t number, Time Entry::*what, Time at) {
    const std::lock_guard lock(mutex_);
    entries_[number].*what = at;
  }
  void add_to(Hops& hops, const StampedSender& sender, Time from) const {
    Time last = kNever;
    for (const auto& [number, entry] : entries_) {
      const Time captured = sender.captured(number);
      if (captured < from || entry.seen == kNever) continue;
      if (last != kNever) hops.longest_gap_ms = std::max(hops.longest_gap_ms, ms(entry.seen - last));
      last = entry.seen;
      hops.all_ms.push_back(ms(entry.seen - captured));
      if (entry.decoded == kNever) continue;
      hops.decoded_ms.push_back(ms(entry.decoded - captured));
      if (entry.taken == kNever || entry.drawn == kNever) continue;
      hops.taken_ms.push_back(ms(entry.taken - entry.decoded));
      hops.drawn_ms.push_back(ms(entry.drawn - entry.taken));
      hops.seen_ms.push_back(ms(entry.seen - entry.drawn));
    }
  }

 private:
  std::mutex mutex_;
  std::map<std::uint32_t, Entry> entries_;
};

std::optional<std::uint32_t> number_in(const std::uint8_t* pixels, int row_bytes) {
  const std::uint8_t* row = pixels + std::ptrdiff_t{StampedPictures::kHeight_px / 2} * row_bytes;
  return StampedPictures::read(StampedPictures::kWidth_px, [row](int x) { return int{row[4 * x]}; });
}

/// The console as an operator has it, at 60 frames/s.
void through_console(console::window::ConsoleWindow& console, Duration time, double loss, Hops& hops) {
  using namespace console;
  std::optional<video::LossyWire> wire;
  if (loss > 0) wire.emplace(kPort, loss);
  const StampedSender sender(wire ? wire->port() : kPort);
  const ConsoleView view = window::canned_view();
  const LoopHealth loop = window::canned_loop();
  EventBook events;
  Log log;
  const Time begin = video::now();
  std::optional<std::uint32_t> taken;
  const CameraFeed camera = feed_of({"test", video::receiver_of(kPort)}, console.bell());
  console.cameras() = {};
  console.cameras().add({camera.name,
                         [&] {
                           auto frame = camera.newest();
                           if (frame) taken = number_in(frame->pixels, frame->row_bytes);
                           if (frame && frame->damaged && video::now() - begin > kWarmUp) ++hops.damaged;
                           if (frame && taken) {
                             log.note(*taken, &Log::Entry::decoded, frame->received);
                             log.note(*taken, &Log::Entry::taken, video::now());
                           }
                           return frame;
                         },
                         camera.status});
  std::uint64_t sent_before = 0;
  {
    const ScreenWatch watch(kInConsole,
                            [&log](std::uint32_t number, Time now) { log.note(number, &Log::Entry::seen, now); });
    while (video::now() - begin < time + kWarmUp) {
      if (video::now() - begin < kWarmUp) sent_before = sender.sent();
      taken.reset();
      console.frame(view, loop, events, 0);
      if (taken) log.note(*taken, &Log::Entry::drawn, video::now());
      console.show();  // and waits until the next frame is due
    }
  }
  hops.sent += sender.sent() - sent_before;
  log.add_to(hops, sender, begin + kWarmUp);
  console.cameras() = {};
}

/// With a window of GStreamer's, which shows each picture as soon as it is there.
void through_gstreamer(const char* window, Duration time, Hops& hops) {
  const StampedSender sender(kPort);
  Log log;
  std::string told;
  const auto pipeline =
      video::make_pipeline(video::receiver_of(kPort) + " ! videoconvert ! " + window + " name=window sync=false", told);
  if (!pipeline) {
    fmt::print(stderr, "glass_to_glass: {}: {} (packages gstreamer1.0-x, gstreamer1.0-gl)\n", window, told);
    std::exit(1);
  }
  gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
  const Time begin = video::now();
  {
    const ScreenWatch watch({0, 0, StampedPictures::kWidth_px, StampedPictures::kHeight_px},
                            [&log](std::uint32_t number, Time now) { log.note(number, &Log::Entry::seen, now); });
    std::this_thread::sleep_for(time + kWarmUp);
  }
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
  log.add_to(hops, sender, begin + kWarmUp);
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
  Hops here, x, gl, lossy;
  for (int turn = 0; turn < kTurns; ++turn) {
    through_console(console, time, 0, here);
    through_gstreamer("ximagesink", time, x);
    through_gstreamer("glimagesink", time, gl);
  }
  through_console(console, time, 0.05, lossy);
  fmt::print("| p50, p99 in ms | console | ximagesink | glimagesink |\n| --- | --- | --- | --- |\n");
  const auto both = [](std::vector<double>& v) {
    return v.empty() ? std::string() : fmt::format("{:.1f}, {:.1f}", quantile(v, 0.5), quantile(v, 0.99));
  };
  const auto row = [&](const char* hop, std::vector<double> Hops::*of) {
    fmt::print("| {} | {} | {} | {} |\n", hop, both(here.*of), both(x.*of), both(gl.*of));
  };
  row("capture, encoder, network, decoder", &Hops::decoded_ms);
  row("waiting to be taken", &Hops::taken_ms);
  row("the frame drawn", &Hops::drawn_ms);
  row("seen on the screen", &Hops::seen_ms);
  row("capture to screen", &Hops::all_ms);
  const auto ratio = [&](Hops& peer) {
    return fmt::format("{:.2f}, {:.2f}", quantile(here.all_ms, 0.5) / quantile(peer.all_ms, 0.5),
                       quantile(here.all_ms, 0.99) / quantile(peer.all_ms, 0.99));
  };
  fmt::print("| pictures seen | {} | {} | {} |\n| console to it | | {} | {} |\n", here.all_ms.size(), x.all_ms.size(),
             gl.all_ms.size(), ratio(x), ratio(gl));
  fmt::print("\nWith 5 % lost: {} sent, {} seen, {} marked as damaged, at most {:.0f} ms apart, capture to screen {}\n",
             lossy.sent, lossy.all_ms.size(), lossy.damaged, lossy.longest_gap_ms, both(lossy.all_ms));
}

}  // namespace
}  // namespace knuckle

int main(int count, char** words) {
  knuckle::run(knuckle::from_seconds(count > 1 ? std::atof(words[1]) : 20));
}
