// What replay must notice, and where: a recording is made, changed at one known place, and run again.
#include "recording/replay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "app/session/session.h"
#include "machine/load.h"
#include "master/master_state.h"
#include "recording/fields.h"
#include "recording/recording.h"
#include "tests/recording/divergence.h"
#include "tests/recording/recorded_session.h"
#include "tests/recording/rewrite.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "transport/link_header.h"

namespace knuckle::recording {
namespace {

constexpr mcap::Compression kFast{1};

/// One wire event: that many-th of its kind in the recording, and the step that it is of.
struct Place {
  Side side{};
  std::uint32_t step = 0;
  std::size_t index = 0;  ///< Among the events of its step.
  std::size_t bits = 0;
};

/// Input and output of the three wires, and whose loop has them.
struct Kind {
  const char* name;
  Side side;
  WireEventKind kind;
};
constexpr Kind kInputs[] = {{"CAN frame", Side::kMachine, WireEventKind::kCanReceived},
                            {"HID report", Side::kOperator, WireEventKind::kHidReceived},
                            {"datagram to the machine", Side::kMachine, WireEventKind::kLinkReceived},
                            {"datagram to the operator", Side::kOperator, WireEventKind::kLinkReceived}};
constexpr Kind kOutputs[] = {{"CAN frame", Side::kMachine, WireEventKind::kCanSent},
                             {"HID report", Side::kOperator, WireEventKind::kHidSent},
                             {"datagram of the machine", Side::kMachine, WireEventKind::kLinkSent},
                             {"datagram of the operator", Side::kOperator, WireEventKind::kLinkSent}};

const char* wires_topic(Side side) {
  return side == Side::kOperator ? "/operator/wires" : "/machine/wires";
}
const char* state_topic(Side side) {
  return side == Side::kOperator ? "/operator/state" : "/machine/state";
}

/// A press on a wall, recorded once for all tests of this file.
class ReplayOfAPress : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder;
    original_ = folder_->file("original.mcap");
    session::SimulateOptions options;
    options.scenario = test::source_dir() + "/tests/recordings_replayed/press.toml";
    options.duration_s = 2;
    RecorderOptions how;
    how.file = original_;
    how.compression = kFast;
    test::record(options, how);
  }
  static void TearDownTestSuite() { delete folder_; }

  void SetUp() override { head_ = Recording({original_}).head(); }

  static ReplayResult replayed(const std::string& file) {
    Recording recording({file});
    ReplayResult result = replay(recording, setup_of(recording));
    EXPECT_TRUE(recording.complete());
    EXPECT_EQ(recording.damages(), std::vector<std::string>());
    return result;
  }

  /// Of a copy with changed messages.
  ReplayResult replay_with(const test::EditMessage& edit) const {
    const std::string copy = folder_->file("copy.mcap");
    std::filesystem::remove(copy);
    test::rewrite(original_, copy, head_, kFast, edit);
    return replayed(copy);
  }

  /// Of a copy in which the events of one step are changed.
  ReplayResult replay_with(const Place& place, bool new_crc, const std::function<void(StepWires&)>& edit) const {
    return replay_with([&](const std::string& topic, std::vector<std::uint8_t>& message) {
      if (topic != wires_topic(place.side)) return true;
      auto wires = decode_wires(message, kLinkVersion);
      if (!wires || wires->step != place.step) return true;
      edit(*wires);
      message = test::encode_wires(*wires, new_crc);
      return true;
    });
  }
  ReplayResult replay_with_flipped_bit(const Place& place, std::size_t bit, bool new_crc) const {
    std::vector<std::uint8_t> changed;
    return replay_with(place, new_crc, [&](StepWires& wires) {
      WireEvent& event = wires.events[place.index];
      changed.assign(event.data.begin(), event.data.end());
      changed[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
      event.data = changed;
    });
  }
  ReplayResult replay_without(const Place& place, bool new_crc) const {
    return replay_with(place, new_crc, [&](StepWires& wires) {
      wires.events.erase(wires.events.begin() + static_cast<std::ptrdiff_t>(place.index));
    });
  }

  /// Where events of a kind are, without the status datagrams, which replay does not compare.
  std::vector<Place> places(const Kind& kind) const {
    std::vector<Place> found;
    Recording recording({original_});
    const Topic topic = kind.side == Side::kOperator ? Topic::kOperatorWires : Topic::kMachineWires;
    while (const auto entry = recording.next()) {
      if (entry->topic != topic) continue;
      const auto wires = decode_wires(entry->data, kLinkVersion);
      for (std::size_t i = 0; i < wires->events.size(); ++i) {
        const WireEvent& event = wires->events[i];
        const bool status = link_kind(event.data) == LinkKind::kStatus && kind.kind == WireEventKind::kLinkSent;
        if (event.kind == kind.kind && !event.data.empty() && !status)
          found.push_back({kind.side, wires->step, i, 8 * event.data.size()});
      }
    }
    return found;
  }
  /// Some of them, evenly spread.
  std::vector<Place> some_places(const Kind& kind, std::size_t count) const {
    const std::vector<Place> all = places(kind);
    std::vector<Place> some;
    for (std::size_t i = 0; i < count; ++i) some.push_back(all.at((2 * i + 1) * all.size() / (2 * count)));
    return some;
  }

  static const SideResult& of(Side side, const ReplayResult& result) {
    return result.sides[static_cast<std::size_t>(side)];
  }
  static void expect_first_at(const Place& place, const ReplayResult& result, const std::string& what) {
    const SideResult& own = of(place.side, result);
    ASSERT_TRUE(own.first) << what;
    EXPECT_EQ(own.first->step, place.step) << what << '\n' << test::words(result);
    const Side other = place.side == Side::kMachine ? Side::kOperator : Side::kMachine;
    EXPECT_EQ(of(other, result).differing, 0u) << what << '\n' << test::words(result);
  }

  inline static test::TemporaryFolder* folder_ = nullptr;
  inline static std::string original_;
  Head head_;
};

TEST_F(ReplayOfAPress, WritesMessagesOfTheWiresAsTheRecorderDoes) {
  Recording recording({original_});
  while (const auto entry = recording.next()) {
    if (entry->topic != Topic::kOperatorWires && entry->topic != Topic::kMachineWires) continue;
    const auto wires = decode_wires(entry->data, kLinkVersion);
    ASSERT_TRUE(wires);
    for (const bool new_crc : {false, true})
      ASSERT_TRUE(std::ranges::equal(test::encode_wires(*wires, new_crc), entry->data)) << wires->step;
  }
}

TEST_F(ReplayOfAPress, OfWhatIsUnchangedIsIdentical) {
  const ReplayResult result = replay_with([](const auto&, auto&) { return true; });
  EXPECT_TRUE(result.identical()) << test::words(result);
  EXPECT_EQ(of(Side::kOperator, result).steps, 2000u);
  EXPECT_EQ(of(Side::kMachine, result).steps, 400u);
}

TEST_F(ReplayOfAPress, WithAChangedGainDiffersFromTheFirstForceOnAndNotBefore) {
  const std::string gain = "\nspring_N_per_m = 1000 ";
  const std::size_t at = head_.device_file.find(gain);
  ASSERT_NE(at, std::string::npos);
  std::uint32_t first_force = 0;
  Recording recording({original_});
  for (std::uint32_t step = 0; const auto entry = recording.next();) {
    if (entry->topic != Topic::kOperatorState) continue;
    master::MasterState state;
    CdrReader in(entry->data);
    get(in, state);
    if (first_force == 0 && !state.law_force_N.isZero(0)) first_force = step;
    ++step;
  }
  ASSERT_GT(first_force, 1000u);
  head_.device_file.replace(at, gain.size(), "\nspring_N_per_m = 1001 ");
  const ReplayResult result = replay_with([](const auto&, auto&) { return true; });
  expect_first_at({Side::kOperator, first_force, 0, 0}, result, "spring");
}

/// The check sum of the step's events is what it was, as where a disk or a person altered the file.
TEST_F(ReplayOfAPress, ReportsAnInputThatWasAlteredOrDroppedInItsStep) {
  for (const Kind& kind : kInputs) {
    std::size_t bit = 0;
    for (const Place& place : some_places(kind, 4)) {
      expect_first_at(place, replay_with_flipped_bit(place, bit % place.bits, false), kind.name);
      bit += 97;
    }
    for (const Place& place : some_places(kind, 1)) expect_first_at(place, replay_without(place, false), kind.name);
  }
}

TEST_F(ReplayOfAPress, ReportsAnOutputThatWasAlteredOrDroppedInItsStep) {
  for (const Kind& kind : kOutputs) {
    std::size_t bit = 0;
    for (const Place& place : some_places(kind, 6)) {
      const ReplayResult result = replay_with_flipped_bit(place, bit % place.bits, true);
      expect_first_at(place, result, std::string(kind.name) + ", bit " + std::to_string(bit % place.bits));
      bit += 97;
    }
    for (const Place& place : some_places(kind, 2)) expect_first_at(place, replay_without(place, true), kind.name);
  }
}

/// Bits 0, 97, 194, ... of what a kind of input is made of, one in each copy. Where the check sum was made anew, only
/// what the loop does can tell: never before the step of the change.
TEST_F(ReplayOfAPress, DoesNotDifferBeforeTheStepOfAnInputThatWasForged) {
  for (const Kind& kind : kInputs) {
    std::size_t bit = 0, at_once = 0;
    for (const Place& place : some_places(kind, 8)) {
      const ReplayResult result = replay_with_flipped_bit(place, bit % place.bits, true);
      bit += 97;
      const auto& first = of(place.side, result).first;
      if (!first) continue;  // a bit that the loop does not look at
      EXPECT_GE(first->step, place.step) << kind.name << '\n' << test::words(result);
      if (first->step == place.step) ++at_once;
    }
    EXPECT_GT(at_once, 0u) << kind.name;
  }
}

TEST_F(ReplayOfAPress, ReportsADroppedStepAtTheNextOne) {
  for (const Side side : {Side::kOperator, Side::kMachine}) {
    for (const std::uint32_t dropped : {1U, 333U}) {
      bool without = false;
      const ReplayResult result = replay_with([&](const std::string& topic, std::vector<std::uint8_t>& message) {
        if (topic == wires_topic(side)) without = decode_wires(message, kLinkVersion)->step == dropped;
        return !(without && (topic == wires_topic(side) || topic == state_topic(side)));
      });
      const std::string number = std::to_string(dropped);
      expect_first_at({side, dropped + 1, 0, 0}, result, number);
      EXPECT_EQ(of(side, result).missing, 1u);
      EXPECT_EQ(of(side, result).first->what.front(),
                "steps " + number + " to " + number + " are missing in the recording");
    }
  }
}

TEST_F(ReplayOfAPress, ANegativeZeroIsADifferenceOfTheSameLoopsOnly) {
  const std::string copy = folder_->file("negative_zero.mcap");
  std::filesystem::remove(copy);
  test::rewrite(original_, copy, head_, kFast, [](const std::string& topic, std::vector<std::uint8_t>& message) {
    master::MasterState state;
    if (topic != state_topic(Side::kOperator) || !decode(message, state)) return true;
    if (state.law_force_N[0] == 0) state.law_force_N[0] = -0.0;
    CdrWriter out(message);
    put(out, state);
    return true;
  });
  for (const bool changed : {false, true}) {
    Recording recording({copy});
    ReplaySetup setup = setup_of(recording);
    setup.changed = changed;
    const ReplayResult result = replay(recording, setup);
    EXPECT_EQ(result.identical(), changed);
    EXPECT_EQ(result.sides[0].fields.contains("law_force_N[0]"), !changed);
  }
}

TEST_F(ReplayOfAPress, OfAFlightRecordIsRefusedWithoutNamingAFirstPart) {
  head_.part = 0;
  const std::string said = test::refusal([&] { (void)replay_with([](const auto&, auto&) { return true; }); });
  EXPECT_TRUE(test::says(said, "(a flight record): "));
  EXPECT_TRUE(test::says(said, "`knuckle explain` reads it"));
  EXPECT_FALSE(test::says(said, "part 1"));
}

}  // namespace
}  // namespace knuckle::recording
