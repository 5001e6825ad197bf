#include "app/programs/slave_cameras.h"

#include <set>
#include <utility>

#include "app/cli/command.h"
#include "core/error.h"
#include "machine/load.h"
#include "transport/socket_address.h"

namespace knuckle::programs {

void add_camera_options(const cli::OptionList& c, CameraOptions& o) {
  c.add_option("--camera", o.cameras,
               "Camera whose pictures are sent to --video-to, NAME=PIPELINE as gst-launch-1.0 takes it, such as "
               "mast='v4l2src device=/dev/video0', or NAME=simulated with --simulate; for each camera once "
               "(docs/camera.md)")
      .value_name("NAME=PIPELINE")
      .one_value_each();
  c.add_option("--video-to", o.to,
               "Address and port that pictures are sent to; the second camera's to the next port, and so on");
  c.add_option("--video-kbps", o.rate_kbps, "Rate of each camera's pictures, at most; lowered where the link suffers")
      .show_default();
}

namespace {

/// As a sender takes it. @throws InputError for one that the machine does not have.
video::CameraSource source_of(const std::string& text, const MachineDescription* simulated) {
  const video::CameraSource camera = video::parse_source(text);
  if (camera.source != kSimulatedCamera) return camera;
  if (simulated == nullptr) cli::refuse_option("--camera", text, "a simulated camera goes with --simulate");
  if (find_camera(*simulated, camera.name) == nullptr)
    cli::refuse_option("--camera", text, simulated->source + " has no [[camera]] of this name");
  return video::given_pictures(camera.name, kDrawnWidth_px, kDrawnHeight_px);
}

}  // namespace

std::vector<video::SenderSetup> check_cameras(const CameraOptions& o, int insecure, const std::string& listen,
                                              const MachineDescription* simulated) {
  if (o.cameras.empty() != o.to.empty())
    throw InputError(o.to.empty() ? "--camera: needs --video-to, the address and port that pictures are sent to"
                                  : "--video-to " + o.to + ": needs --camera");
  if (o.cameras.empty()) return {};
  cli::check_range("--video-kbps", o.rate_kbps, video::kLeastRate_kbps, video::kMostRate_kbps, " kbit/s");
  const SocketAddress address = parse_address(o.to, "--video-to");
  if (!address.is_loopback() && insecure == 1)
    cli::refuse_option(
        "--video-to", o.to,
        "with --insecure pictures are not encrypted: they go to this computer's own addresses (127.0.0.1), or, in a "
        "lab, elsewhere where it is given twice (docs/camera.md)");
  const HostAndPort to = parse_host_and_port(o.to, "--video-to");
  if (to.port + o.cameras.size() > 65536) cli::refuse_option("--video-to", o.to, "leaves no port for each camera");
  const std::size_t link_port = listen.empty() ? 0 : parse_address(listen, "--listen").port();
  if (address.is_loopback() && link_port >= to.port && link_port < to.port + o.cameras.size())
    cli::refuse_option("--video-to", o.to,
                       "a camera's pictures would go to port " + std::to_string(link_port) + ", which is --listen's");
  std::vector<video::SenderSetup> setups;
  std::set<std::string> names;
  for (const std::string& text : o.cameras) {
    const auto port = static_cast<std::uint16_t>(to.port + setups.size());
    setups.push_back({source_of(text, simulated), to.host, port, o.rate_kbps, insecure == 0});
    if (!names.insert(setups.back().camera.name).second)
      throw InputError("--camera " + setups.back().camera.name +
                       ": is given twice; each camera needs a name of its own");
    video::check_sender(setups.back());
  }
  return setups;
}

SlaveCameras::SlaveCameras(const std::vector<video::SenderSetup>& setups)
    : rule_(setups.empty() ? video::kMostRate_kbps : setups.front().rate_kbps) {
  for (const video::SenderSetup& setup : setups)
    all_.push_back({setup.camera.name, std::make_unique<video::Sender>(setup), {}, 0, 0, {}});
}

SlaveCameras::SlaveCameras(const std::vector<video::SenderSetup>& setups, const MachineDescription& machine,
                           const sim::WorldDescription& world, const DrawCamera& draw)
    : SlaveCameras(setups) {
  for (std::size_t i = 0; i < all_.size(); ++i) {
    if (!setups[i].camera.given) continue;
    video::Sender& sender = *all_[i].sender;
    all_[i].drawn = draw(machine, *find_camera(machine, all_[i].name), world,
                         [&sender](std::unique_ptr<video::Frame> frame) { sender.give(std::move(frame)); });
  }
}

void SlaveCameras::seal_with(const std::optional<secure::VideoSecret>& secret) {
  rule_.begin();
  for (const Sent& sent : all_)
    sent.sender->set_key(secret ? std::optional(secure::video_key(*secret, sent.name)) : std::nullopt);
}

void SlaveCameras::follow_link(Time now, Time heard_at, Duration round_trip, bool silent) {
  const int rate_kbps = rule_.step(now, heard_at, round_trip, silent);
  for (const Sent& sent : all_) sent.sender->set_rate(rate_kbps);
}

/// A camera that keeps failing in the same way is one line.
std::vector<cli::News> SlaveCameras::news() {
  std::vector<cli::News> news;
  const auto tell = [&news](Sent& sent, const video::CameraStatus& status, std::uint32_t& troubles) {
    if (status.troubles == std::exchange(troubles, status.troubles)) return;
    const std::string problem = status.why.data();
    if (problem != sent.problem) news.push_back({problem, "camera " + sent.name});
    sent.problem = problem;
  };
  for (Sent& sent : all_) {
    tell(sent, sent.sender->status(), sent.troubles);
    if (sent.drawn.status) tell(sent, sent.drawn.status(), sent.drawn_troubles);
  }
  return news;
}

}  // namespace knuckle::programs
