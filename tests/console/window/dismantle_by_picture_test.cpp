// A machine that is elsewhere, led by what its camera shows and by keys alone: two programs, 100 ms there and back for
// the link and half of it for the pictures. Nobody looks at what the link says of the machine's pose, nor at the
// simulation.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "app/console/console_host.h"
#include "app/console/hand_input.h"
#include "machine/load.h"
#include "tests/console/window/eyes.h"
#include "tests/support/free_address.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"
#include "tests/video/lossy_wire.h"
#include "transport/udp_link.h"
#include "video/camera.h"
#include "video/sender.h"

namespace knuckle::test {
namespace {

using console::HeldKeys;

constexpr Duration kOneWay = 50ms;
constexpr double kGround_m = -0.8;  // where the tracks stand: a quarter of the machine's reach below the boom's pin

double rad(double degrees) {
  return degrees * M_PI / 180;
}

std::string here(std::uint16_t port) {
  return "127.0.0.1:" + std::to_string(port);
}

MachineDescription machine_file() {
  return calibrated(load_machine(find_config("machine", "solar015")));
}

console::StationSetup station(const MachineDescription& machine) {
  console::StationSetup setup;
  setup.side.machine = machine;
  setup.side.device = device_for(machine, "");
  setup.side.law = setup.side.device.feel.law;
  setup.side.start = random_start();
  setup.limb = sim::sample_limb(sim::LimbClass::kNormal, 1);
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto axis = static_cast<Eigen::Index>(j);
    setup.hand_rad[axis] = 0.5 * (setup.side.device.min_rad[j] + setup.side.device.max_rad[j]);
    setup.start_rad[axis] = 0.5 * (machine.links[j].min_rad + machine.links[j].max_rad);
  }
  return setup;
}

/// The machine's side as a program, a network, and an operator with eyes and keys.
class ByPicture {
 public:
  ByPicture() {
    std::ofstream(folder_.file("link.toml")) << "name = \"away\"\ndescription = \"far away\"\n[both]\ndelay_ms = 50\n";
    relay_ = std::make_unique<RunningProgram>(
        program("knuckle"), std::vector<std::string>{"relay", "--listen", here(relay_port_), "--connect",
                                                     here(slave_port_), "--impairment", folder_.file("link.toml")});
    slave_ = std::make_unique<RunningProgram>(
        program("knuckle"),
        std::vector<std::string>{"slave", "--simulate", "--scenario", "dismantle", "--insecure", "--no-log", "--listen",
                                 here(slave_port_), "--camera", "mast=simulated", "--video-to", here(wire_.port()),
                                 "--json", folder_.file("slave.json")});
    host_ = std::make_unique<console::ConsoleHost>(station(machine_), link_, nullptr);
    host_->begin();
  }

  /// What the machine's side says at its end.
  nlohmann::json end() {
    host_->stop();
    slave_->signal(SIGTERM);
    const ProgramRun run = slave_->wait();
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return nlohmann::json::parse(std::ifstream(folder_.file("slave.json")));
  }

  /// Looks at the screen and holds these keys, once a frame of the window.
  void look(const HeldKeys& keys) {
    std::this_thread::sleep_for(16ms);
    if (auto frame = camera_.take()) {
      frame_ = std::move(frame);
      if (const auto seen = eyes_.bucket(*frame_)) {
        bucket_ = seen;
        seen_at_ = video::now();
      }
    }
    console::ConsoleInput input;
    input.at = host_->now();
    input.attended = true;
    input.hand = console::hand_from_keys(keys);
    host_->put(input);
    mode_ = host_->view().machine.mode;  // the banner across the screen
  }
  bool until(const HeldKeys& keys, double most_s, const std::function<bool()>& so) {
    for (const Time begin = video::now(); video::now() - begin < from_seconds(most_s);) {
      look(keys);
      if (so()) return true;
    }
    return false;
  }
  /// Whoever does not see the bucket leads nothing.
  [[nodiscard]] bool sees() const { return bucket_ && video::now() - seen_at_ < 1s; }

  bool engage() {
    for (int tries = 0; tries < 10; ++tries) {
      (void)until({}, 0.5, [] { return false; });
      if (until({.enable = true}, 5, [this] { return mode_ == Mode::kEngaged; })) {
        engaged_at_ = video::now();
        return true;
      }
    }
    return false;
  }

  /// Keys towards a pose, as a person taps them: let go of before it is there, for what is seen is old.
  [[nodiscard]] static HeldKeys keys_towards(const JointVector& to_go_rad) {
    const JointVector dead{0.018, 0.025, 0.04};
    const JointVector time_s = to_go_rad.cwiseAbs().cwiseQuotient(console::kFullRate_radps);
    HeldKeys keys{.enable = true};
    keys.slow = time_s.maxCoeff() < 1.0;
    keys.boom_up = to_go_rad[kBoom] > dead[kBoom];
    keys.boom_down = to_go_rad[kBoom] < -dead[kBoom];
    keys.arm_out = to_go_rad[kArm] > dead[kArm];
    keys.arm_in = to_go_rad[kArm] < -dead[kArm];
    keys.bucket_out = to_go_rad[kBucket] > dead[kBucket];
    keys.bucket_in = to_go_rad[kBucket] < -dead[kBucket];
    return keys;
  }
  /// @return whether the tip was seen there.
  bool move_to(
      const PlanarVector& tip_m, double bucket_deg, double most_s = 25,
      const std::function<bool()>& enough = [] { return false; }, bool gently = false) {
    const auto goal = kinematics_.inverse(tip_m, rad(bucket_deg));
    if (!goal) return false;
    int there = 0;
    for (const Time begin = video::now(); video::now() - begin < from_seconds(most_s);) {
      if (enough()) return true;
      if (mode_ != Mode::kEngaged && !engage()) return false;  // let go, press again: as the banner says
      if (!sees()) {
        look({.enable = true});
        continue;
      }
      HeldKeys keys = keys_towards(*goal - bucket_->joint_rad);
      keys.slow |= gently;
      look(keys);
      const bool still =
          !(keys.boom_up || keys.boom_down || keys.arm_out || keys.arm_in || keys.bucket_in || keys.bucket_out);
      there = still ? there + 1 : 0;
      if (there > 25) return true;
    }
    return false;
  }

  [[nodiscard]] const std::optional<SeenBucket>& bucket() const { return bucket_; }
  [[nodiscard]] const video::Frame& frame() const { return *frame_; }
  [[nodiscard]] bool has_frame() const { return frame_ != nullptr; }
  /// The picture as it is now; nothing held but enable.
  std::unique_ptr<video::Frame> glance() {
    frame_.reset();
    (void)until({.enable = true}, 5, [this] { return frame_ != nullptr; });
    return std::move(frame_);
  }
  [[nodiscard]] Mode mode() const { return mode_; }
  [[nodiscard]] Time engaged_at() const { return engaged_at_; }
  [[nodiscard]] const Eyes& eyes() const { return eyes_; }

 private:
  const TemporaryFolder folder_;
  const MachineDescription machine_ = machine_file();
  const Kinematics kinematics_{machine_};
  const Eyes eyes_{machine_, machine_.cameras.at(0)};
  const std::uint16_t slave_port_ = free_port(), relay_port_ = free_port(), video_port_ = free_port();
  video::LossyWire wire_{video_port_, 0, kOneWay};
  video::Camera camera_{{"mast", video::receiver_of(video_port_)}};
  std::unique_ptr<RunningProgram> relay_, slave_;
  UdpLink link_ = UdpLink::connect(here(relay_port_));
  std::unique_ptr<console::ConsoleHost> host_;
  std::unique_ptr<video::Frame> frame_;
  std::optional<SeenBucket> bucket_;
  Time seen_at_ = kNever, engaged_at_ = kNever;
  Mode mode_ = Mode::kOff;
};

std::string told(const ByPicture& work) {
  if (!work.bucket()) return "no bucket seen";
  const SeenBucket& b = *work.bucket();
  return "tip seen at " + std::to_string(b.tip_m.x()) + ", " + std::to_string(b.tip_m.y()) + ", foremost " +
         std::to_string(b.foremost_m) + ", bucket " + std::to_string(b.angle_rad * 180 / M_PI) + " deg, mode " +
         name(work.mode());
}

/// On against whatever is there, until it is seen not to go on. @return how far forward the bucket reaches then: keys
/// lead the joints, so that the bucket is curled in on the way, and touches with its heel.
std::optional<double> touch(ByPicture& work, double z_m, double bucket_deg) {
  double furthest_m = 0;
  Time gained_at = video::now();
  const auto stalled = [&] {
    if (!work.sees()) gained_at = video::now();  // who sees nothing holds no key: that is no stall
    if (work.bucket() && work.bucket()->foremost_m > furthest_m + 0.01) {
      furthest_m = work.bucket()->foremost_m;
      gained_at = video::now();
    }
    return work.mode() == Mode::kEngaged && video::now() - std::max(gained_at, work.engaged_at()) > 1200ms;
  };
  if (!work.move_to({2.75, z_m}, bucket_deg, 40, stalled, true)) return std::nullopt;
  return furthest_m;
}

TEST(DeepDismantleByPictureThreads, AWholeDismantleByKeysAndTheCamerasPictureAlone) {
  ByPicture work;
  ASSERT_TRUE(work.until({}, 60, [&] { return work.sees(); })) << "a picture with the bucket in it";
  ASSERT_TRUE(work.engage()) << told(work);
  ASSERT_TRUE(work.move_to({1.95, 0.2}, -40)) << told(work);
  const auto before = work.glance();
  ASSERT_NE(before, nullptr);

  // The wall: touched where it stands, leaned on until the bucket goes on.
  const auto wall_m = touch(work, 0.1, -40);
  ASSERT_TRUE(wall_m) << told(work);
  EXPECT_NEAR(*wall_m, 2.3, 0.1) << "seen, not known; " << told(work);
  const auto broke = [&] { return work.bucket()->foremost_m > *wall_m + 0.08; };
  ASSERT_TRUE(work.move_to({2.75, 0.1}, -40, 60, broke, true)) << told(work);
  ASSERT_TRUE(broke()) << told(work);
  ASSERT_TRUE(work.move_to({1.95, 0.2}, -40)) << told(work);
  (void)work.until({.enable = true}, 5, [] { return false; });  // the dust settles

  // The piece: what lies there that did not before. Scooped until it is gone from the ground.
  const auto find = [&]() -> std::optional<Eyes::NewThing> {
    const auto now = work.glance();
    return now ? work.eyes().new_on_ground(*before, *now, kGround_m, 1.2, 2.15) : std::nullopt;
  };
  auto piece = find();
  ASSERT_TRUE(piece) << "a piece on the ground; " << told(work);
  const Eyes::NewThing first = *piece;
  for (int tries = 0; tries < 3 && piece && piece->pixels > first.pixels / 2; ++tries) {
    const PlanarVector at = piece->centre_m;
    EXPECT_TRUE(work.move_to(at + PlanarVector(0.30, 0.55), -95)) << told(work);
    // Along the ground: how large the piece looks, and so how high its middle is, shadow and dust make too large.
    constexpr double kAlong_m = kGround_m + 0.14;
    EXPECT_TRUE(work.move_to({at.x() + 0.25, kAlong_m}, -105)) << told(work);
    EXPECT_TRUE(work.move_to({at.x() - 0.20, kAlong_m}, -150)) << told(work);
    EXPECT_TRUE(work.move_to({1.8, 0.2}, -145)) << told(work);
    ASSERT_TRUE(work.move_to({1.95, 0.25}, -140)) << told(work);
    piece = find();
  }
  EXPECT_TRUE(!piece || piece->pixels <= first.pixels / 2) << "still on the ground";

  (void)work.until({.enable = true}, 3, [] { return false; });  // it is weighed
  EXPECT_TRUE(work.move_to({2.1, 0.3}, -60)) << told(work);
  (void)work.until({.enable = true}, 1, [] { return false; });
  EXPECT_EQ(work.mode(), Mode::kEngaged);
  (void)work.until({}, 0.5, [] { return false; });

  const nlohmann::json json = work.end();
  const nlohmann::json& happened = json.at("simulated").at("happened");
  EXPECT_EQ(happened.value("piece_broke", 0), 1) << happened;
  EXPECT_EQ(happened.value("scooped", 0), 1) << happened;
  EXPECT_GE(happened.value("dumped", 0), 1) << happened;
  EXPECT_EQ(json.at("faults"), nlohmann::json::array()) << json.at("realtime");
}

}  // namespace
}  // namespace knuckle::test
