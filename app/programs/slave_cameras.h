// The cameras of the machine's side: what is sent of them, and at which rate.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/session/machine_sight.h"
#include "core/time.h"
#include "machine/description.h"
#include "transport/secure/video_key.h"
#include "video/rate_rule.h"
#include "video/sender.h"

namespace knuckle::programs {

/// The word for a camera on the simulated machine, as a source.
inline constexpr const char* kSimulatedCamera = "simulated";

/// A camera that draws what is before it, in a thread of its own.
struct DrawnCamera {
  std::function<void(const session::MachineSight&)> show;  ///< Fit for a real-time step; one thread.
  std::function<video::CameraStatus()> status;
};
/// Makes one. @param give gets its pictures, of this size, in the thread that draws; outlives what show() is of.
using DrawCamera =
    std::function<DrawnCamera(const MachineDescription&, const CameraDescription&, const sim::WorldDescription&,
                              std::function<void(std::unique_ptr<video::Frame>)> give)>;
inline constexpr int kDrawnWidth_px = 1280, kDrawnHeight_px = 720;

struct CameraOptions {
  std::vector<std::string> cameras;  ///< NAME=SOURCE each.
  std::string to;        ///< Of the operator's computer; the second camera goes to the next port, and so on.
  int rate_kbps = 4000;  ///< Each, at most.
};
void add_camera_options(const cli::OptionList& command, CameraOptions& options);
/// @param insecure how often --insecure was given. @param listen where the link's end at the machine is, HOST:PORT; may
/// be empty. @param simulated the simulated machine, whose cameras may be sent; nullptr: the machine is a real one.
/// @throws InputError, one line. Pictures are sealed with the link's session; where there is none, they go to this
/// computer itself, or where somebody has said twice that the network is not to be secured.
[[nodiscard]] std::vector<video::SenderSetup> check_cameras(const CameraOptions& options, int insecure,
                                                            const std::string& listen,
                                                            const MachineDescription* simulated = nullptr);

/// Sends from construction on; the loops notice nothing of it.
class SlaveCameras {
 public:
  explicit SlaveCameras(const std::vector<video::SenderSetup>& setups);
  /// The same, where some are of a simulated machine. @param draw makes these.
  SlaveCameras(const std::vector<video::SenderSetup>& setups, const MachineDescription& machine,
               const sim::WorldDescription& world, const DrawCamera& draw);

  /// What the simulated machine's cameras have before them now. One thread; fit for a real-time step.
  void show(const session::MachineSight& sight) const {
    for (const Sent& sent : all_)
      if (sent.drawn.show) sent.drawn.show(sight);
  }

  /// Of the session that is there now: pictures are sealed with it from now on. nullopt: there is none, and none is
  /// sent.
  void seal_with(const std::optional<secure::VideoSecret>& secret);
  /// Often; never waits. Parameters as of video::RateRule::step().
  void follow_link(Time now, Time heard_at, Duration round_trip, bool silent);
  /// What has happened since.
  [[nodiscard]] std::vector<cli::News> news();

 private:
  struct Sent {
    std::string name;
    std::unique_ptr<video::Sender> sender;
    DrawnCamera drawn;  ///< Of a simulated machine. Ends before what it gives to.
    std::uint32_t troubles = 0, drawn_troubles = 0;
    std::string problem;
  };
  std::vector<Sent> all_;
  video::RateRule rule_;
};

}  // namespace knuckle::programs
