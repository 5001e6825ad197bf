#include "app/programs/slave_cameras.h"

#include <CLI/CLI.hpp>
#include <set>
#include <utility>

#include "app/cli/command.h"
#include "core/error.h"
#include "transport/socket_address.h"

namespace knuckle::programs {

void add_camera_options(CLI::App& c, CameraOptions& o) {
  c.add_option("--camera", o.cameras,
               "Camera whose pictures are sent to --video-to, NAME=PIPELINE as gst-launch-1.0 takes it, such as "
               "mast='v4l2src device=/dev/video0'; for each camera once (docs/camera.md)")
      ->type_name("NAME=PIPELINE")
      ->allow_extra_args(false);
  c.add_option("--video-to", o.to,
               "Address and port that pictures are sent to; the second camera's to the next port, and so on");
  c.add_option("--video-kbps", o.rate_kbps, "Rate of each camera's pictures, at most; lowered where the link suffers")
      ->capture_default_str();
}

std::vector<video::SenderSetup> check_cameras(const CameraOptions& o, int insecure, const std::string& listen) {
  if (o.cameras.empty() != o.to.empty())
    throw InputError(o.to.empty() ? "--camera: needs --video-to, the address and port that pictures are sent to"
                                  : "--video-to " + o.to + ": needs --camera");
  if (o.cameras.empty()) return {};
  cli::check_range("--video-kbps", o.rate_kbps, video::kLeastRate_kbps, video::kMostRate_kbps, " kbit/s");
  const SocketAddress address = parse_address(o.to, "--video-to");
  if (!address.is_loopback() && insecure < 2)
    cli::refuse_option(
        "--video-to", o.to,
        "pictures are not encrypted: they go to this computer's own addresses (127.0.0.1), or, in a lab, "
        "elsewhere where --insecure is given twice; use a tunnel (docs/camera.md)");
  const HostAndPort to = parse_host_and_port(o.to, "--video-to");
  if (to.port == 0) cli::refuse_option("--video-to", o.to, "its port must be 1 to 65535");
  if (to.port + o.cameras.size() > 65536) cli::refuse_option("--video-to", o.to, "leaves no port for each camera");
  const std::size_t link_port = listen.empty() ? 0 : parse_host_and_port(listen, "--listen").port;
  if (address.is_loopback() && link_port >= to.port && link_port < to.port + o.cameras.size())
    cli::refuse_option("--video-to", o.to,
                       "a camera's pictures would go to port " + std::to_string(link_port) + ", which is --listen's");
  std::vector<video::SenderSetup> setups;
  std::set<std::string> names;
  for (const std::string& text : o.cameras) {
    const auto port = static_cast<std::uint16_t>(to.port + setups.size());
    setups.push_back({video::parse_source(text), to.host, port, o.rate_kbps});
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
    all_.push_back({setup.camera.name, std::make_unique<video::Sender>(setup), 0, {}});
}

void SlaveCameras::follow_link(Time now, Duration round_trip, bool silent) {
  const int rate_kbps = rule_.step(now, round_trip, silent);
  for (const Sent& sent : all_) sent.sender->set_rate(rate_kbps);
}

/// A camera that keeps failing in the same way is one line.
std::vector<cli::News> SlaveCameras::news() {
  std::vector<cli::News> news;
  for (Sent& sent : all_) {
    const video::CameraStatus& status = sent.sender->status();
    if (status.troubles == std::exchange(sent.troubles, status.troubles)) continue;
    const std::string problem = status.why.data();
    if (problem != sent.problem) news.push_back({problem, "camera " + sent.name});
    sent.problem = problem;
  }
  return news;
}

}  // namespace knuckle::programs
