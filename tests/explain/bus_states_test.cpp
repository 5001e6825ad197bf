// What explain says of the CAN controllers' states at a stop.
#include <gtest/gtest.h>

#include <array>
#include <iterator>
#include <map>
#include <string>

#include "app/explain/evidence.h"
#include "app/explain/timeline.h"
#include "machine/load.h"
#include "recording/wire_events.h"
#include "tests/support/says.h"
#include "tests/support/two_buses.h"

namespace knuckle::explain {
namespace {

using recording::WireEventKind;

using test::says;

/// What explain says of a stop at 1 s where CAN states were recorded so. @param told by its time, as recorded
std::string inputs_of(const MachineDescription& machine, const std::map<Time, std::uint32_t>& told) {
  Stop stop;
  stop.at = Time(1s);
  Window window;
  window.to = Time(1400ms);
  for (Time at = Time(500ms); at < window.to; at += 5ms) window.machine_steps.push_back({at, 0});
  for (const auto& [at, value] : told) window.changes.push_back({at, WireEventKind::kCanState, value});
  std::string text;
  for (const std::string& line : last_inputs(stop, window, evidence_of(stop, window, machine), machine.bus))
    text += line + "\n";
  return text;
}

/// Of a controller that answers so at each of its times. Every step asks.
std::string inputs_by(const MachineDescription& machine,
                      const std::map<Duration, std::array<CanState, 2>>& from_then_on) {
  std::map<Time, std::uint32_t> told;
  for (Time at = Time(500ms); at < Time(1400ms); at += 5ms)
    told[at] = recording::can_states_value(std::prev(from_then_on.upper_bound(at.time_since_epoch()))->second);
  return inputs_of(machine, told);
}

TEST(Explain, SaysInWhichStateEachOfTwoBusesIsAndTheWorseOneSinceWhen) {
  const MachineDescription machine = parse_machine(test::two_buses_text(), "m.toml");
  const CanState sound = CanState::kActive, passive = CanState::kPassive, off = CanState::kBusOff;
  const std::string second = inputs_by(machine, {{0s, {sound, sound}}, {900ms, {sound, passive}}});
  EXPECT_TRUE(says(second, "controller of bus machine error-passive since 0.900 s, of bus valves sound;"));
  EXPECT_TRUE(says(second, "changed first: CAN controller of bus machine error-passive at 0.900 s"));
  const std::string both = inputs_by(machine, {{0s, {sound, sound}}, {900ms, {off, sound}}, {950ms, {off, passive}}});
  EXPECT_TRUE(says(both, "controller of bus valves bus-off since 0.900 s, of bus machine error-passive;"));
}

TEST(Explain, SaysOfTheOtherBusNothingThatAnOlderRecordingDoesNotTell) {
  const std::uint32_t passive = static_cast<std::uint32_t>(CanState::kPassive) | 1U << recording::kStateOfBit;
  const std::string text = inputs_of(parse_machine(test::two_buses_text(), "m.toml"), {{Time(900ms), passive}});
  EXPECT_TRUE(says(text, "controller of bus machine error-passive since 0.900 s;"));
  EXPECT_FALSE(says(text, "bus valves"));
}

TEST(Explain, DoesNotTakeASoundControllerForASign) {
  const std::string inputs = inputs_by(load_machine(find_config("machine", "solar015")), {{0s, {}}});
  EXPECT_TRUE(says(inputs, "controller sound;"));
  EXPECT_FALSE(says(inputs, "CAN controller"));
}

}  // namespace
}  // namespace knuckle::explain
