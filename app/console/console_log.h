// The console's recordings: one for each session, of which a simulated one is restarted as often as anybody likes.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/json.h"
#include "app/cli/terminal.h"
#include "app/console/console_view.h"
#include "app/console/event_book.h"
#include "app/console/operator_station.h"
#include "app/recordings/program_log.h"
#include "app/session/options.h"
#include "app/session/session.h"
#include "core/time.h"
#include "recording/events.h"
#include "recording/head.h"
#include "recording/recorder.h"
#include "video/frame.h"
#include "video/jpeg_encoder.h"

namespace knuckle::console {

/// What the command line says of it.
struct LogChoice {
  recordings::LogOptions options;
  bool real = false;  ///< A machine or a haptic device that no console simulates: recorded unless turned off.
  std::string program = "knuckle console";  ///< With its arguments.
};

/// A simulated session begun now: on the computer's clock, though pauses stop it.
[[nodiscard]] recording::Head head_of(const session::SessionSetup& setup, const session::SimulateOptions& options,
                                      const LogChoice& choice);
/// The operator's side of a machine that is elsewhere. @param unix_ns of session time 0.
[[nodiscard]] recording::Head head_of(const StationSetup& setup, std::int64_t unix_ns, const LogChoice& choice);

/// For the window's thread. The loops' only part in it is the ring of the recorder they were given.
class ConsoleLog {
 public:
  explicit ConsoleLog(LogChoice choice) : choice_(std::move(choice)) {}

  /// Opens the recording of the session begun next. @return nullptr: there is none; valid until the session after that
  /// one has begun. @throws InputError where the first one's folder, which was named, cannot be written; of later ones
  /// the light says so.
  [[nodiscard]] recording::Recorder* make(const recording::Head& head, const MachineDescription& machine);
  /// The session for which make() was called has begun, and the one before steps no more. Finishes its files.
  void take_over(std::uint32_t run);
  /// Writes what the loops have handed over, until begin().
  void drain();
  /// From now on a thread of its own does that.
  void begin();
  /// After the loops have ended: finishes the files.
  void close();

  /// Into the recording of its session.
  void note(const EventRow& row);
  void note(std::uint32_t run, const recording::CameraStamp& stamp);
  void note(std::uint32_t run, const recording::CameraPicture& picture);
  [[nodiscard]] RecordingLight light() const;
  /// What has come up since the last call.
  [[nodiscard]] std::vector<cli::News> news();
  [[nodiscard]] const LogChoice& choice() const noexcept { return choice_; }
  /// Of the newest session, as the programs' (docs/programs.md).
  [[nodiscard]] std::vector<std::string> notes() const;
  [[nodiscard]] cli::Json json() const;

 private:
  struct OfSession {
    std::unique_ptr<recordings::ProgramLog> log;
    std::string refused;  ///< Why there is none.
  };
  void take_news();
  /// Of the session of this run; nullptr: nothing is recorded of it.
  [[nodiscard]] recording::Recorder* recorder_of(std::uint32_t run) const;

  LogChoice choice_;
  OfSession current_, next_;
  std::uint32_t run_ = 0;
  bool begun_ = false;
  std::vector<cli::News> news_;
};

// Pictures of the cameras for the recording, as the operator saw them: so many a second, as JPEG.

/// For the window's thread.
class PictureLog {
 public:
  /// @param per_s of each camera, at most; 0: none. @throws InputError as video::JpegEncoder does.
  explicit PictureLog(double per_s);

  struct Made {
    std::uint32_t run = 0;  ///< The session it was shown in.
    recording::CameraPicture picture;
  };
  /// A picture that is shown now, which is one of the recorded where its turn has come. One of each session time: none
  /// while a session is paused.
  void show(std::uint32_t run, const recording::CameraStamp& stamp, const video::Frame& frame);
  /// Those made since the last call.
  [[nodiscard]] std::vector<Made> made();
  /// Of which camera nothing is recorded any more, and why, once each.
  [[nodiscard]] std::vector<std::string> problems();

 private:
  struct Camera {
    video::JpegEncoder encoder;
    Made next;  ///< Being made.
    Time last = kNever;
  };

  Duration period_;
  std::map<std::string, std::unique_ptr<Camera>> cameras_;
};

}  // namespace knuckle::console
