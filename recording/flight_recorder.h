// The last half minute, always at hand: when something stops the machine, it is written into a file of its own, and
// with it what comes in the next seconds.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>

#include "core/time.h"
#include "recording/file_names.h"
#include "recording/head.h"
#include "recording/mcap/chunk.h"
#include "recording/mcap/file_writer.h"

namespace knuckle::recording {

class FlightRecorder {
 public:
  static constexpr Duration kBefore = 30s, kAfter = 5s;
  static constexpr Duration kLongest = 60s;  ///< Behind the first stop; one that comes later begins the next file.
  static constexpr std::size_t kMostPerHour = 12;  ///< Files: a fault that comes and goes must not fill the folder.

  /// @param folder where files go; empty: none is written, nor anything kept.
  FlightRecorder(std::string folder, Head head);

  /// Chunks as they are finished; takes it. @return one that is no longer needed, to be used again.
  [[nodiscard]] mcap::Chunk take(mcap::Chunk chunk);
  /// The machine was stopped: begins a file, or, where one is open, extends it to kAfter behind this stop.
  /// @param why for the name of the file. @return false: no file, since there were kMostPerHour in the last hour.
  [[nodiscard]] bool trigger(Time at, const std::string& why);
  /// The session ends: an open file is finished.
  void close();

  /// What became of a file: written, or refused by the disk. Called by take() and close().
  std::function<void(Time at, const std::string& file, const std::string& problem)> on_file;

 private:
  [[nodiscard]] bool may_begin(Time at);
  void begin();
  void end();
  void fail(int error);

  std::string folder_;
  Head head_;
  std::deque<mcap::Chunk> kept_;
  std::deque<Time> begun_at_;  // in the last hour
  mcap::FileWriter file_;
  NewestMark mark_;
  std::string path_, why_, next_why_, problem_;
  Time triggered_at_ = kNever, newest_trigger_ = kNever, next_at_ = kNever;
  bool open_ = false, failed_ = false;
};

}  // namespace knuckle::recording
