// A camera on a simulated machine: the machine as it truly stands and the world around it, drawn from the camera's
// place in a thread of its own, thirty times a second.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>

#include "app/console/console_view.h"
#include "app/console/picture/live_scene.h"
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

  SimulatedCamera(const MachineDescription& machine, const CameraDescription& mount);
  ~SimulatedCamera();
  SimulatedCamera(const SimulatedCamera&) = delete;
  SimulatedCamera& operator=(const SimulatedCamera&) = delete;

  // One thread; none of it waits.
  /// Another session's world.
  void begin(const sim::WorldDescription& world);
  /// What is so now. @param at when it was, by video::now(): what a picture of it is stamped with. @param delay how
  /// long pictures travel.
  void show(const ConsoleView& view, Time at, Duration delay);
  [[nodiscard]] std::unique_ptr<video::Frame> take() noexcept { return frames_.take(); }
  [[nodiscard]] video::CameraStatus status();

 private:
  struct Seen {
    Time at{};
    Duration delay{};
    double session_s = 0;
    JointVector joint_rad = JointVector::Zero();
    sim::WorldEventRing events;
  };
  void run();
  void draw_all();

  const MachineDescription machine_;
  const CameraDescription mount_;
  Mailbox<Seen> seen_;
  video::Newest<sim::WorldDescription> worlds_;
  video::Newest<video::Frame> frames_;
  Mailbox<video::CameraStatus> statuses_;
  video::CameraStatus status_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace knuckle::console::picture
