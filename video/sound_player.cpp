#include "video/sound_player.h"

#include <gst/app/gstappsrc.h>

#include <cstdlib>
#include <filesystem>
#include <utility>

#include "core/error.h"
#include "core/text.h"
#include "video/gst_owned.h"

namespace knuckle::video {
namespace {

constexpr GstClockTime kBusWait = 100 * GST_MSECOND;  // how soon an end is noticed
constexpr GstClockTime kPatience = 2 * GST_SECOND;    // beyond the length of a sound

/// A sound server of this session, or a playback device of the kernel.
bool has_audio_device() {
  namespace fs = std::filesystem;
  std::error_code none;
  if (std::getenv("PULSE_SERVER") != nullptr) return true;
  if (const char* run = std::getenv("XDG_RUNTIME_DIR"); run != nullptr)
    for (const char* server : {"/pulse/native", "/pipewire-0"})
      if (fs::exists(std::string(run) + server, none)) return true;
  for (fs::directory_iterator at("/dev/snd", none), end; !none && at != end; at.increment(none)) {
    const std::string name = at->path().filename().string();
    if (name.starts_with("pcm") && name.ends_with("p")) return true;
  }
  return false;
}

}  // namespace

SoundPlayer::SoundPlayer(std::string sink) : sink_(std::move(sink)), thread_([this] { run(); }) {}

SoundPlayer::~SoundPlayer() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  news_.notify_one();
  thread_.join();
}

void SoundPlayer::play(std::vector<std::int16_t> samples) {
  {
    const std::scoped_lock lock(mutex_);
    next_ = std::move(samples);
  }
  news_.notify_one();
}

std::string SoundPlayer::problem() const {
  const std::scoped_lock lock(mutex_);
  return problem_;
}

void SoundPlayer::run() {
  try_out(std::vector<std::int16_t>(kRate_Hz / 100));  // whether anything can be heard is known before the first alarm
  for (;;) {
    std::vector<std::int16_t> samples;
    {
      std::unique_lock lock(mutex_);
      news_.wait(lock, [this] { return ending_ || !next_.empty(); });
      if (ending_) return;
      samples.swap(next_);
    }
    try_out(samples);
  }
}

void SoundPlayer::try_out(const std::vector<std::int16_t>& samples) {
  std::string problem;
  try {
    problem = play_through(samples);
  } catch (const InputError& error) {
    problem = error.what();
  }
  const std::scoped_lock lock(mutex_);
  problem_ = std::move(problem);
}

std::string SoundPlayer::play_through(const std::vector<std::int16_t>& samples) {
  // Where there is none, the libraries below would write lines of their own to standard error.
  if (sink_ == kAutomatic && !has_audio_device()) return "this computer has no audio device";
  start_gstreamer();
  std::string told;
  const Owned<GstElement> pipeline =
      make_pipeline("appsrc name=samples format=time caps=audio/x-raw,format=S16LE,rate=" + std::to_string(kRate_Hz) +
                        ",channels=1,layout=interleaved ! audioconvert ! audioresample ! " + sink_,
                    told);
  if (!pipeline) return told;
  const Owned<GstElement> source(gst_bin_get_by_name(GST_BIN(pipeline.get()), "samples"));
  gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
  gst_app_src_push_buffer(GST_APP_SRC(source.get()),
                          gst_buffer_new_memdup(samples.data(), samples.size() * sizeof(std::int16_t)));
  gst_app_src_end_of_stream(GST_APP_SRC(source.get()));
  const Owned<GstBus> bus(gst_element_get_bus(pipeline.get()));
  const auto wanted = static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR | GST_MESSAGE_WARNING);
  std::string problem;
  const GstClockTime longest = GST_SECOND * samples.size() / kRate_Hz + kPatience;
  GstClockTime waited = 0;
  for (bool playing = true; playing; waited += kBusWait) {
    if (waited > longest) {
      problem = "the sound device does not play";
      break;
    }
    if (const Owned<GstMessage> message{gst_bus_timed_pop_filtered(bus.get(), kBusWait, wanted)}) {
      if (GST_MESSAGE_TYPE(message.get()) != GST_MESSAGE_EOS) problem = complaint(message.get());
      playing = GST_MESSAGE_TYPE(message.get()) == GST_MESSAGE_WARNING;
    }
    const std::scoped_lock lock(mutex_);
    playing = playing && !ending_;
  }
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
  return problem;
}

}  // namespace knuckle::video
