// A camera on a simulated machine: the machine as it truly stands and the world around it, drawn from the camera's
// place in a thread of its own, thirty times a second. For the console, or for a sender of pictures.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "app/session/scene.h"
#include "core/mailbox.h"
#include "machine/description.h"
#include "video/camera.h"
#include "video/frame.h"
#include "video/newest.h"

namespace knuckle::console::picture {

class SimulatedCamera {
 public:
  static constexpr int kWidth_px = 1280, kHeight_px = 720;
  static constexpr Duration kPeriod{33'333'333};

  /// Gets each picture, in the thread that draws.
  using Give = std::function<void(std::unique_ptr<video::Frame>)>;

  SimulatedCamera(const MachineDescription& machine, const CameraDescription& mount, Give give);
  ~SimulatedCamera();
  SimulatedCamera(const SimulatedCamera&) = delete;
  SimulatedCamera& operator=(const SimulatedCamera&) = delete;

  // Each for one thread; none of it waits.
  /// Another session's world.
  void begin(const sim::WorldDescription& world);
  /// What is so now: a picture of it is stamped with its time. Fit for a real-time step. @param delay how long pictures
  /// travel.
  void show(const session::MachineSight& sight, Duration delay = {}) noexcept { seen_.put({sight, delay}); }
  [[nodiscard]] video::CameraStatus status();

 private:
  struct Seen {
    session::MachineSight sight;
    Duration delay{};
  };
  void run();
  void draw_all();

  const MachineDescription machine_;
  const CameraDescription mount_;
  const Give give_;
  Mailbox<Seen> seen_;
  video::Newest<sim::WorldDescription> worlds_;
  Mailbox<video::CameraStatus> statuses_;
  video::CameraStatus status_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace knuckle::console::picture
