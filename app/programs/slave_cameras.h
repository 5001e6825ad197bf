// The cameras of the machine's side: what is sent of them, and at which rate.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/cli/news.h"
#include "core/time.h"
#include "video/rate_rule.h"
#include "video/sender.h"

namespace CLI {
class App;
}

namespace knuckle::programs {

struct CameraOptions {
  std::vector<std::string> cameras;  ///< NAME=SOURCE each.
  std::string to;        ///< Of the operator's computer; the second camera goes to the next port, and so on.
  int rate_kbps = 4000;  ///< Each, at most.
};
void add_camera_options(CLI::App& command, CameraOptions& options);
/// @param insecure how often --insecure was given. @param listen where the link's end at the machine is, HOST:PORT; may
/// be empty. @throws InputError, one line. Pictures are not encrypted: they go to
/// this computer itself, or where somebody has said twice that the network is not to be secured.
[[nodiscard]] std::vector<video::SenderSetup> check_cameras(const CameraOptions& options, int insecure,
                                                            const std::string& listen);

/// Sends from construction on; the loops notice nothing of it.
class SlaveCameras {
 public:
  explicit SlaveCameras(const std::vector<video::SenderSetup>& setups);

  /// Often; never waits. @param round_trip, @param silent of the link.
  void follow_link(Time now, Duration round_trip, bool silent);
  /// What has happened since.
  [[nodiscard]] std::vector<cli::News> news();

 private:
  struct Sent {
    std::string name;
    std::unique_ptr<video::Sender> sender;
    std::uint32_t troubles = 0;
    std::string problem;
  };
  std::vector<Sent> all_;
  video::RateRule rule_;
};

}  // namespace knuckle::programs
