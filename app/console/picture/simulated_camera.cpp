#include "app/console/picture/simulated_camera.h"

#include <algorithm>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "app/console/picture/dust.h"
#include "app/console/picture/gl_program.h"
#include "app/console/picture/machine_view.h"
#include "app/console/picture/world_mesh.h"
#include "core/error.h"

namespace knuckle::console::picture {
namespace {

/// Memory for pictures, used again once nobody looks at it.
class Pictures {
 public:
  using Bytes = std::vector<std::uint8_t>;
  std::shared_ptr<Bytes> next() {
    const auto free = std::find_if(all_.begin(), all_.end(), [](const auto& one) { return one.use_count() == 1; });
    if (free != all_.end()) return *free;
    return all_.emplace_back(
        std::make_shared<Bytes>(std::size_t{4} * SimulatedCamera::kWidth_px * SimulatedCamera::kHeight_px));
  }

 private:
  std::vector<std::shared_ptr<Bytes>> all_;
};

/// All that OpenGL needs, in the thread that draws.
struct Drawing {
  Drawing(const MachineDescription& machine, const CameraDescription& mount)
      : view(machine), scene(reach_m(machine)), camera(mounted_camera(machine, mount)), dust(machine) {
    begin({});
  }

  void begin(const sim::WorldDescription& world) {
    scene.begin(world);
    dust.begin(world);
  }

  std::unique_ptr<video::Frame> draw(const session::MachineSight& sight) {
    scene.watch(sight.events);
    dust.watch(sight);
    constexpr int kWidth = SimulatedCamera::kWidth_px, kHeight = SimulatedCamera::kHeight_px;
    MachinePicture picture;
    picture.measured_rad = sight.joint_rad;
    picture.scene = &scene.scene();
    picture.scene_s = sight.session_s;
    picture.dust = &dust.at(sight.session_s);
    picture.as_seen = true;
    view.draw(picture, camera, {.width_px = kWidth, .height_px = kHeight}, colours);
    const auto bytes = pictures.next();
    screen.read_from_above(bytes->data());
    auto frame = std::make_unique<video::Frame>();
    frame->width_px = kWidth;
    frame->height_px = kHeight;
    frame->row_bytes = 4 * kWidth;
    frame->pixels = bytes->data();
    frame->memory = bytes;
    frame->connection = 1;
    frame->received = video::now();
    return frame;
  }

  Offscreen screen{SimulatedCamera::kWidth_px, SimulatedCamera::kHeight_px};
  MachineView view;
  LiveScene scene;
  Camera camera;
  Dust dust;
  PictureColours colours = light_picture_colours();
  Pictures pictures;
};

}  // namespace

SimulatedCamera::SimulatedCamera(const MachineDescription& machine, const CameraDescription& mount, Give give)
    : machine_(machine), mount_(mount), give_(std::move(give)), thread_([this] { run(); }) {}

SimulatedCamera::~SimulatedCamera() {
  ending_ = true;
  thread_.join();
}

void SimulatedCamera::begin(const sim::WorldDescription& world) {
  worlds_.put(std::make_unique<sim::WorldDescription>(world));
}

video::CameraStatus SimulatedCamera::status() {
  statuses_.take(status_);
  return status_;
}

void SimulatedCamera::run() {
  video::CameraStatus status;
  try {
    status.playing = true;
    statuses_.put(status);
    draw_all();
  } catch (const InputError& error) {
    const std::string why = "camera " + mount_.name + ": " + error.what();
    status.playing = false;
    status.troubles = 1;
    std::copy_n(why.begin(), std::min(why.size(), status.why.size() - 1), status.why.begin());
    statuses_.put(status);
  }
}

void SimulatedCamera::draw_all() {
  Drawing drawing(machine_, mount_);
  std::deque<Seen> travelling;  // oldest first
  Time drawn = kNever;
  std::uint64_t number = 0;
  for (Time next = video::now(); !ending_; next = std::max(next + kPeriod, video::now() - kPeriod)) {
    std::this_thread::sleep_until(std::chrono::steady_clock::time_point(next.time_since_epoch()));
    if (const auto world = worlds_.take()) drawing.begin(*world);
    Seen newest;
    if (seen_.take(newest)) travelling.push_back(newest);
    const auto arrived = [](const Seen& seen) { return seen.sight.at + seen.delay <= video::now(); };
    while (travelling.size() > 1 && arrived(travelling[1])) travelling.pop_front();
    if (travelling.empty() || !arrived(travelling.front()) || travelling.front().sight.at == drawn) continue;
    const session::MachineSight& sight = travelling.front().sight;
    drawn = sight.at;
    auto frame = drawing.draw(sight);
    frame->number = ++number;
    frame->captured = sight.at;
    give_(std::move(frame));
  }
}

}  // namespace knuckle::console::picture
