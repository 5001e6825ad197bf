#include "app/motion/led_machine.h"

#include <algorithm>
#include <string>

#include "app/motion/transfer.h"
#include "core/loop_table.h"

namespace knuckle::motion {
namespace {

constexpr Duration kComeUp = 15s, kRestart = 3s, kRest = 20s;  // patience
constexpr Duration kBeforeMoving = 500ms, kRelease = 300ms;

}  // namespace

LedMachine::LedMachine(const MachineDescription& machine, BusAccess& access, Time first_step)
    : machine_(machine),
      kinematics_(machine),
      access_(access),
      period_(from_seconds(1 / machine.bus.sync_Hz)),
      step_due_(first_step),
      link_({}, {}, 1),
      leader_(link_.a(), start_from(0, LinkEnd::kOperator)),
      slave_(machine, access.bus(), link_.b(), start_from(0, LinkEnd::kMachine)) {}

/// A period that was missed is skipped.
bool LedMachine::advance() {
  access_.wait_until(access_.now() + kTick);
  const Time now = access_.now();
  link_.advance(now);
  leader_.step(now);
  if (now < step_due_) return false;
  step_due_ = std::max(step_due_ + period_, now);
  slave_.step(now);
  return true;
}

bool LedMachine::tick() {
  const bool stepped = advance();
  if (stepped) each_step();
  if (leader_.dropped_out()) throw NotLed("the machine is no longer engaged: " + text(leader_.trouble()));
  return stepped;
}

bool LedMachine::run_until(const std::function<bool()>& reached, Duration patience) {
  for (const Time end = access_.now() + patience; !reached(); tick()) {
    if (access_.now() >= end) return false;
  }
  return true;
}

void LedMachine::require(bool reached, const char* otherwise) const {
  if (reached) return;
  std::string why = text(slave_.client().setup_failure());
  if (const Reason trouble = leader_.trouble(); why.empty() && trouble) why = text(trouble);
  throw NotLed(otherwise + (why.empty() ? why : ": " + why));
}

void LedMachine::engage() {
  require(run_until([this] { return leader_.engaged(); }, kComeUp), "the machine did not engage within 15 s");
}

void LedMachine::rest(Duration still) {
  require(rests(still, kRest), "the machine did not come to rest within 20 s");
}

void LedMachine::settle(Duration still, Duration patience) {
  (void)rests(still, patience);
}

bool LedMachine::rests(Duration still, Duration patience) {
  return run_until([&] { return leader_.at_rest(access_.now(), still); }, patience);
}

void LedMachine::stand(Duration still) {
  leader_.stand();
  rest(still);
}

void LedMachine::pause(Duration time) {
  leader_.stand();
  (void)run_until([] { return false; }, time);
}

void LedMachine::go_to(const JointVector& pose_rad) {
  stand(kBeforeMoving);
  lead(transfer(machine_, kinematics_, leader_.machine()->position_rad, pose_rad, to_seconds(period_)));
  require(run_until([this] { return leader_.engaged(); }, kRestart), "the machine did not engage again within 3 s");
  (void)run_until([this] { return done(); }, Duration::max() / 4);
}

bool LedMachine::record(estimation::Recording& into) {
  const JointVector demand = slave_.client().demand();  // on the wire while these sensors were sampled
  const auto measured = tick() ? slave_.sensors().measurement() : std::nullopt;
  if (!measured) return false;
  into.samples.push_back(*measured);
  into.samples.back().cylinder_m += machine_.sensors.encoder_offset_m;  // as the encoder reports it
  into.usable.push_back(1);
  into.valve.push_back(demand);
  return true;
}

void LedMachine::neutral() noexcept {
  leader_.stand();
  for (const Time end = access_.now() + kRelease; access_.now() < end;) advance();
}

}  // namespace knuckle::motion
