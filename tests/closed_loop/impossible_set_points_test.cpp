// The operator's set-points are changed on their way into what no hand can make: the machine stops where it is, says
// which joint and why, and waits until enable is released, also once the set-points are sound again.
#include <gtest/gtest.h>

#include <functional>

#include "app/session/loop_views.h"
#include "app/session/session_sides.h"
#include "sim/operator.h"
#include "tests/closed_loop/session_rig.h"
#include "transport/impaired_link.h"

namespace knuckle::test {
namespace {

constexpr int kMoving = 1, kWaiting = 2;
constexpr Duration kInMotion = 2300ms;  // the sweep is fast then
constexpr Duration kLasts = 1500ms;

/// Engage, sweep, go on holding enable for a while, engage anew.
session::SessionSetup story(std::uint64_t seed) {
  session::SessionSetup setup = session_setup("link_faults", seed);
  sim::Phase engage, sweep = phase_named(setup.scenario, "cut"), wait;
  engage.kind = sim::PhaseKind::kEngage;
  sweep.until_fault = false;
  sweep.duration_s = to_seconds(kInMotion + kLasts) + 1;
  wait.kind = sim::PhaseKind::kWait;
  wait.duration_s = 1;
  setup.scenario.phases = {engage, sweep, wait, engage};
  setup.scenario.faults.clear();
  setup.scenario.duration_s = 30;
  return setup;
}

/// The machine's end of the link, where set-points are changed while `on`.
class ChangedLink final : public Link {
 public:
  ChangedLink(Link& link, std::function<void(MasterMessage&)> change) : link_(link), change_(std::move(change)) {}
  bool send(std::span<const std::uint8_t> bytes) noexcept override { return link_.send(bytes); }
  bool receive(Datagram& datagram) noexcept override {
    if (!link_.receive(datagram)) return false;
    auto message = decode_master(datagram.view());
    if (!message) return true;
    if (!on) last_rad_ = message->position_rad;
    if (on && stands) message->position_rad = last_rad_;
    if (on) change_(*message);
    const auto changed = encode(*message);
    datagram.size = static_cast<std::uint16_t>(changed.view().size());
    std::copy(changed.view().begin(), changed.view().end(), datagram.bytes.begin());
    return true;
  }
  bool on = false;
  bool stands = false;  ///< The position stays where it was.

 private:
  Link& link_;
  std::function<void(MasterMessage&)> change_;
  JointVector last_rad_ = JointVector::Zero();
};

/// Operator, device, master, link, machine in lock-step, as a session has them.
struct ChangedSession {
  ChangedSession(const session::SessionSetup& s, std::function<void(MasterMessage&)> change)
      : setup(s), link(network.b(), std::move(change)) {}

  void step() {
    now += 1ms;
    network.advance(now);
    const session::MasterView shown = session::view_of(now, master);
    const sim::OperatorIntent intent =
        person.step(now, session::person_view(shown, setup.scenario.start_rad, hand.device.truth(), 0));
    enable_held = enable_held && intent.enable;
    hand.step(now, intent);
    master.step(now);
    far.step(now, [&] { far.slave.step(now); });
    moved_rad = std::max(moved_rad, (machine_rad() - from_rad).cwiseAbs().maxCoeff());
  }
  void change() {
    link.on = enable_held = true;
    from_rad = machine_rad();
    moved_rad = 0;
  }
  bool reaches(int phase, Duration in_phase) {
    while (now < Time(from_seconds(setup.scenario.duration_s)) && !person.finished()) {
      if (person.phase() == phase && person.in_phase(now) >= in_phase) return true;
      step();
    }
    return false;
  }
  [[nodiscard]] const JointVector& machine_rad() const { return far.simulated.plant().joint_rad; }
  session::SessionSetup setup;
  Time now{};
  bool enable_held = true;                     // since the change, ...
  JointVector from_rad = JointVector::Zero();  // ... where the machine was then, ...
  double moved_rad = 0;                        // ... and the farthest any joint has been from there
  sim::Operator person = session::operator_of(setup);
  session::HandSide hand{setup.device, setup.limb, setup.seed, setup.scenario.hand_rad};
  ImpairedLink network{setup.to_machine, setup.to_operator, setup.seed};
  ChangedLink link;
  master::MasterLoop master{setup.device,
                            setup.machine,
                            hand.cable.host(),
                            network.a(),
                            start_from(setup.seed, LinkEnd::kOperator),
                            setup.law,
                            master::FarEnd::kIsThisMachine};
  session::MachineSide far{setup.machine, setup.truth, setup.scenario, setup.seed, link};
};

struct Case {
  const char* what;
  ReasonCode code;
  bool position_stands;
  std::function<void(MasterMessage&)> change;
};

TEST(ImpossibleSetPoints, HoldTheMachineWhereItIsUntilEnableIsReleased) {
  constexpr double kMostMoved_rad = 0.05;  // what was on its way: the sweep at 0.2 rad/s, valve and spool closing
  const Case cases[] = {
      {"at +10 rad", ReasonCode::kSetpointRange, false, [](MasterMessage& m) { m.position_rad.setConstant(10); }},
      {"at -10 rad", ReasonCode::kSetpointRange, false, [](MasterMessage& m) { m.position_rad.setConstant(-10); }},
      {"200 rad/s", ReasonCode::kSetpointSpeed, true, [](MasterMessage& m) { m.velocity_radps.setConstant(200); }},
      {"3 rad/s", ReasonCode::kSetpointJump, true, [](MasterMessage& m) { m.velocity_radps.setConstant(3); }},
      {"-3 rad/s", ReasonCode::kSetpointJump, true, [](MasterMessage& m) { m.velocity_radps.setConstant(-3); }},
      {"a jump", ReasonCode::kSetpointJump, false, [](MasterMessage& m) { m.position_rad[kArm] += 0.3; }},
  };
  for (const std::uint64_t seed : {1U, 2U}) {
    for (const Case& c : cases) {
      SCOPED_TRACE(std::string(c.what) + ", seed " + std::to_string(seed));
      ChangedSession s(story(seed), c.change);
      s.link.stands = c.position_stands;
      ASSERT_TRUE(s.reaches(kMoving, kInMotion));
      ASSERT_EQ(s.far.slave.mode(), Mode::kEngaged) << text(s.far.slave.blocking());
      ASSERT_GT(s.far.slave.commands().cwiseAbs().maxCoeff(), 0.1) << "nothing moves that a hold could stop";
      s.change();
      ASSERT_TRUE(s.reaches(kMoving, kInMotion + kLasts));
      EXPECT_EQ(s.far.slave.mode(), Mode::kHold);
      s.link.on = false;  // sound again, and enable still held
      ASSERT_TRUE(s.reaches(kWaiting, 500ms));
      EXPECT_TRUE(s.enable_held);
      EXPECT_EQ(s.far.slave.mode(), Mode::kHold);
      EXPECT_EQ(s.far.slave.blocking().code, c.code) << text(s.far.slave.blocking());
      EXPECT_EQ(s.far.slave.commands(), JointVector(0, 0, 0));
      EXPECT_LT(s.moved_rad, kMostMoved_rad);
      while (!s.person.finished() && s.now < Time(30s)) s.step();
      EXPECT_LT(s.person.timed_out(), 0);
      EXPECT_EQ(s.far.slave.mode(), Mode::kEngaged)
          << "released, pressed and aligned anew: " << text(s.far.slave.blocking());
    }
  }
}

}  // namespace
}  // namespace knuckle::test
