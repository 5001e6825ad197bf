// Takes what the loops' taps hand over and puts it on the disk: in parts of bounded size in a folder of bounded size,
// or in one file, and the last half minute of every stop in a file of its own. Loops never wait for it: what it cannot
// take is counted, and a disk that refuses ends the recording, not the session.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/byte_ring.h"
#include "core/time.h"
#include "machine/description.h"
#include "recording/events.h"
#include "recording/file_names.h"
#include "recording/flight_recorder.h"
#include "recording/head.h"
#include "recording/loop_tap.h"
#include "recording/mcap/chunk.h"
#include "recording/mcap/file_writer.h"
#include "recording/scene.h"
#include "recording/topics.h"

namespace knuckle::recording {

struct RecorderOptions {
  std::string file;    ///< All into this one, FILE.partial until it is complete; empty: parts in the folder.
  std::string folder;  ///< Of parts and flight records; empty: no flight records.
  bool keep = true;    ///< false: flight records alone.
  mcap::Compression compression{1};  ///< Higher levels of zstd take longer and save less than 1 %.
  /// Of each loop's steps on their way here: more than two seconds of the busiest loop. Less, where it is drained
  /// often, stays in the processor's cache.
  std::size_t ring_bytes = std::size_t{1} << 22;
  Duration chunk = 500ms;  ///< At most so much is lost when the program is killed.
  std::uint64_t part_bytes = std::uint64_t{1} << 30;
  Duration part = std::chrono::hours(1);
  std::uint64_t folder_bytes = std::uint64_t{20} << 30;
  std::uint64_t least_free_bytes = std::uint64_t{256}
                                   << 20;  ///< On the disk, or a tenth of it; else the recording ends. Not of `file`.
};

/// For displays.
struct RecorderStatus {
  bool recording = false;
  std::string file;                         ///< Being written, or the last.
  std::string problem;                      ///< Why the recording has ended; empty: it has not.
  std::uint64_t bytes = 0, free_bytes = 0;  ///< Of all parts; left on the disk.
  std::uint64_t steps_lost = 0;             ///< There was no room for them.
  std::vector<std::string> flights;         ///< Files of flight records, the newest last.
  std::vector<std::string> notices;         ///< What a person should hear of besides: refused, deleted. Bounded.
};

class Recorder {
 public:
  /// @param machine draws the scene. @throws InputError (of --log) where the first file or the folder cannot be made.
  Recorder(RecorderOptions options, Head head, const MachineDescription& machine);
  /// As close().
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// For LoopTap::record_to(), one loop each.
  [[nodiscard]] ByteRing& operator_steps() noexcept { return *rings_[0]; }
  [[nodiscard]] ByteRing& machine_steps() noexcept { return *rings_[1]; }

  // Any thread but the loops'.
  void event(const Event& event);
  void camera(const CameraStamp& stamp);
  void camera(const CameraPicture& picture);
  [[nodiscard]] RecorderStatus status() const;

  // One thread.
  /// Writes what the loops have handed over.
  void drain();
  /// After the loops have ended: writes all that is left and finishes the files.
  /// @param replaces false: a file that has the name already stays, and this one stays FILE.partial.
  void close(bool replaces = true);

 private:
  static constexpr std::size_t kSides = 2;
  static constexpr Duration kScenePeriod = 40ms;

  /// A message of another thread's.
  struct Posted {
    Topic topic;
    std::int64_t time_ns;
    std::vector<std::uint8_t> message;
  };

  void take_steps(std::size_t side);
  void post(Topic topic, Time at, std::vector<std::uint8_t> message);
  void take_posted();
  void add(Topic topic, std::int64_t time_ns, std::span<const std::uint8_t> message);
  void draw(std::int64_t time_ns, std::span<const std::uint8_t> state);
  void watch(std::size_t side, Time at, ReasonCode alarm);
  void finish_chunk();
  void write(const mcap::Chunk& chunk);
  [[nodiscard]] bool open_part(std::int64_t at_ns);
  [[nodiscard]] bool put_in_place(bool replaces);
  void end_recording(Time at, const std::string& why);
  [[nodiscard]] bool room_for_more(Time at);
  void notice(Time at, Severity severity, const std::string& text);
  void say(Time at, Severity severity, const std::string& text);

  RecorderOptions options_;
  Head head_;
  std::array<std::unique_ptr<ByteRing>, kSides> rings_;
  SceneWriter scene_;
  mcap::ChunkBuilder builder_;
  mcap::Chunk spare_;
  mcap::FileWriter file_;
  NewestMark mark_;
  std::string path_;  // of file_
  FlightRecorder flights_;
  std::array<std::uint32_t, static_cast<std::size_t>(Topic::kCount)> sequences_{};
  std::array<ReasonCode, kSides> alarms_{};
  std::array<std::uint64_t, kSides> told_lost_{};
  std::int64_t newest_ns_ = 0, drawn_ns_ = -1, part_began_ns_ = 0;
  std::uint64_t bytes_before_ = 0;  // of the parts before this one
  bool recording_ = false, closed_ = false;
  mutable std::mutex mutex_;  // of the next two
  std::vector<Posted> posted_;
  RecorderStatus status_;
};

/// Drains a recorder 50 times a second in a thread of its own, from construction on.
class RecorderThread {
 public:
  explicit RecorderThread(Recorder& recorder);
  /// Ends the thread; the recorder is yet to be closed.
  ~RecorderThread();
  RecorderThread(const RecorderThread&) = delete;
  RecorderThread& operator=(const RecorderThread&) = delete;

 private:
  std::jthread thread_;
};

}  // namespace knuckle::recording
