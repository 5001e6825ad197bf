// Short sounds through GStreamer, in a thread of its own: who asks for one does not wait, and of those that wait only
// the newest is played.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace knuckle::video {

class SoundPlayer {
 public:
  static constexpr int kRate_Hz = 48000;
  static constexpr const char* kAutomatic = "autoaudiosink";

  /// @param sink as gst-launch-1.0 takes it.
  explicit SoundPlayer(std::string sink = kAutomatic);
  /// Ends what is being played.
  ~SoundPlayer();
  SoundPlayer(const SoundPlayer&) = delete;
  SoundPlayer& operator=(const SoundPlayer&) = delete;

  /// @param samples one channel at kRate_Hz; less than a few seconds.
  void play(std::vector<std::int16_t> samples);
  /// Why the last sound was not heard, in one line; empty: nothing is known against it.
  [[nodiscard]] std::string problem() const;

 private:
  void run();
  void try_out(const std::vector<std::int16_t>& samples);
  [[nodiscard]] std::string play_through(const std::vector<std::int16_t>& samples);

  const std::string sink_;
  mutable std::mutex mutex_;  // of the next four
  std::condition_variable news_;
  std::vector<std::int16_t> next_;
  std::string problem_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace knuckle::video
