// A master at its desk for tests and benchmarks: simulated hand and device on a HID cable, and a scripted machine at
// the other end of an impaired link.
#pragma once

#include <functional>

#include "core/joints.h"
#include "core/time.h"
#include "master/master_loop.h"
#include "sim/haptic_device.h"
#include "tests/master/desk.h"
#include "transport/hid_pair.h"
#include "transport/impaired_link.h"
#include "transport/link_messages.h"
#include "transport/link_session.h"
#include "transport/machine_status.h"

namespace knuckle::test {

/// Everything around one MasterLoop. `machine` is what the scripted machine answers every 5 ms, and `status` what it
/// tells of itself every 50 ms; by default it follows the set-point at once, confident, without contact, and is the
/// right one.
struct MasterRig {
  explicit MasterRig(ControlLaw law = ControlLaw::kEchoSpring, Duration one_way = 1ms,
                     const sim::LimbImpedance& limb = steady_limb(), const DeviceDescription& device = desk_device())
      : network(delayed(one_way), delayed(one_way), 1),
        hand(device, limb, cable.device(), 1, kMidPosture, 77),
        loop(device, desk_machine(), cable.host(), network.a(), {5, 1h}, law) {
    intent.joint_rad = kMidPosture;
    intent.presence = true;
    machine.mode = Mode::kReady;
    machine.confidence = 1;
    machine.position_rad = kMidPosture;
    status.machine = MachineName(desk_machine().name);
  }

  [[nodiscard]] static LinkImpairment delayed(Duration one_way) {
    LinkImpairment link;
    link.delay = one_way;
    return link;
  }
  void tick() {
    now += 1ms;
    cable.advance();
    network.advance(now);
    hand.step(now, intent);
    loop.step(now);
    while (network.b().receive(datagram)) {
      if (const auto home = decode_home(datagram.view())) {
        home_heard = *home;
        ++homes_heard;
      }
      auto message = decode_master(datagram.view());
      if (!message) continue;
      (void)session.take(message->stamp, now);
      heard = *message;
      heard_at = now;
    }
    if (now.time_since_epoch() % 5ms != 0ns || machine_silent) return;
    if (follow) machine.position_rad = heard.position_rad;
    if (react) react(*this);
    machine.ahead_rad = heard.position_rad - machine.position_rad;
    tell();
    if (now.time_since_epoch() % 50ms == 0ms && tells_status) tell_status();
  }
  void tell() {
    machine.stamp = session.stamp(machine.stamp.sequence + 1, now);
    network.b().send(encode(machine).view());
  }
  void tell_status() {
    status.stamp = session.stamp(status.stamp.sequence + 1, now);
    network.b().send(encode(status).view());
  }
  void run(double seconds) {
    for (int i = 0; i < int(seconds * 1e3 + 0.5); ++i) tick();
  }
  /// Past the handshake and engaged in free space.
  void engage() {
    run(0.3);
    machine.mode = Mode::kEngaged;
    run(0.1);
  }

  Time now{};
  HidPair cable;
  ImpairedLink network;
  sim::HandAndDevice hand;
  master::MasterLoop loop;
  sim::OperatorIntent intent;
  SlaveMessage machine;
  MachineStatus status;
  bool follow = true, machine_silent = false, tells_status = true;
  std::function<void(MasterRig&)> react;
  LinkSession session{{11, 2h}, 200ms};  ///< The machine's.
  MasterMessage heard;                   ///< Its echo by the machine's clock, which is `now`.
  Time heard_at{};
  HomeMessage home_heard;
  int homes_heard = 0;
  Datagram datagram;
};

/// The machine presses against something: its tip stays a few millimetres (hand) above the hand's, its force points up.
inline void push_back(MasterRig& rig, double force_N = 2000) {
  rig.follow = false;
  rig.machine.tip_force_N = PlanarVector(0, force_N);
  rig.machine.covariance_N2 = {400, 0, 400};
  rig.react = [](MasterRig& r) { r.machine.position_rad = r.heard.position_rad + JointVector(0.012, 0, 0); };
}

}  // namespace knuckle::test
