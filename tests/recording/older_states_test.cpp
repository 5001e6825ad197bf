// States of versions of Knuckle that record other fields, or in another order, are read by the names in their schema.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "master/master_state.h"
#include "recording/replay.h"
#include "recording/states.h"
#include "slave/slave_state.h"
#include "tests/recording/divergence.h"
#include "tests/recording/rewrite.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::recording {
namespace {

constexpr std::uint8_t kDoubts = 0x85;
using Lines = std::vector<std::string>;  ///< "float64 payload_kg"

/// Today's fields of a state, and all behind them.
template <typename State>
std::pair<Lines, std::string> schema_lines() {
  const std::string text = schema_text<State>();
  const std::size_t behind = text.find("====");
  Lines lines;
  std::istringstream own(text.substr(0, behind));
  for (std::string line; std::getline(own, line);) lines.push_back(line);
  return {lines, text.substr(behind)};
}

/// A state with these fields, in their order; one that it has not, of type uint8 or float64[3], is 7.
template <typename State>
std::vector<std::uint8_t> message_of(const State& state, const Lines& fields) {
  std::vector<std::uint8_t> room(4096);
  CdrWriter out(room);
  for (const std::string& line : fields) {
    bool there = false;
    visit_fields(state, [&](const char* name, const auto& member) {
      if (schema_name(name) != line.substr(line.find(' ') + 1) || line == "uint8 confidence_reasons") return;
      put(out, member);
      there = true;
    });
    if (line == "uint8 confidence_reasons") {
      out.put(kDoubts);
      continue;
    }
    if (!there && line.starts_with("uint8 ")) out.put(std::uint8_t{7});
    if (!there && line.starts_with("float64[3] ")) put(out, std::array{7.0, 7.0, 7.0});
  }
  room.resize(out.size());
  return room;
}

class OlderStates : public testing::Test {
 protected:
  /// A recorded press whose states have fields so changed.
  std::string changed(const std::function<void(Lines&)>& change) {
    const std::string file = folder_.file("changed.mcap");
    std::filesystem::remove(file);
    auto [machine, machine_inner] = schema_lines<slave::SlaveState>();
    auto [side, side_inner] = schema_lines<master::MasterState>();
    change(machine);
    change(side);
    const auto text = [](const Lines& lines, const std::string& inner) {
      std::string all;
      for (const std::string& line : lines) all += line + '\n';
      return all + inner;
    };
    test::rewrite(
        press_, file, Recording({press_}).head(), mcap::Compression{1},
        [&](const std::string& topic, std::vector<std::uint8_t>& message) {
          slave::SlaveState its;
          master::MasterState mine;
          if (topic == "/machine/state" && decode(message, its)) message = message_of(its, machine);
          if (topic == "/operator/state" && decode(message, mine)) message = message_of(mine, side);
          return true;
        },
        [&](mcap::Topics& topics) {
          for (auto& [id, schema] : topics.schemas) {
            if (schema.name.ends_with("MachineState")) schema.data = text(machine, machine_inner);
            if (schema.name.ends_with("OperatorState")) schema.data = text(side, side_inner);
          }
        });
    return file;
  }
  static std::vector<slave::SlaveState> machine_states(const std::string& file) {
    Recording recording({file});
    std::vector<slave::SlaveState> all;
    while (const auto entry = recording.next())
      if (entry->topic == Topic::kMachineState) all.push_back(state_in<slave::SlaveState>(*entry, recording));
    return all;
  }
  static std::vector<std::string> notes(const std::string& file) {
    Recording recording({file});
    while (recording.next()) continue;
    return remarks(recording);
  }
  /// How its replay differs: all of it on a processor whose last bits are others, nothing on that of the recording.
  static std::string divergence(const std::string& file) {
    Recording recording({file});
    const ReplayResult result = replay(recording, setup_of(recording));
    EXPECT_GT(result.sides[1].steps, 500u);
    return test::words(result);
  }
  /// Their numbers, as bytes.
  static std::vector<std::uint8_t> bytes(const slave::SlaveState& state) {
    return message_of(state, schema_lines<slave::SlaveState>().first);
  }

  test::TemporaryFolder folder_;
  std::string press_ = test::source_dir() + "/tests/recordings_replayed/press.mcap";
};

void remove_field(Lines& lines, const std::string& name) {
  std::erase_if(lines, [&](const std::string& line) { return line.ends_with(' ' + name); });
}

TEST_F(OlderStates, WithFewerBitsOfDoubtHaveTheOnesTheyHad) {
  const std::string file = changed([](Lines& lines) {
    std::replace(lines.begin(), lines.end(), std::string("uint16 confidence_reasons"),
                 std::string("uint8 confidence_reasons"));
  });
  const auto states = machine_states(file);
  ASSERT_FALSE(states.empty());
  for (const slave::SlaveState& state : states) EXPECT_EQ(state.confidence_reasons, kDoubts);
}

TEST_F(OlderStates, WithMoreFieldsAndInAnotherOrderAreReadAndRunAgainAsIfTheyWereOfToday) {
  const std::string file = changed([](Lines& lines) {
    std::reverse(lines.begin(), lines.end());
    lines.insert(lines.begin() + 3, {"uint8 gone", "float64[3] gone_as_well"});
  });
  const auto original = machine_states(press_), states = machine_states(file);
  ASSERT_GT(original.size(), 500u);
  ASSERT_EQ(states.size(), original.size());
  for (std::size_t i = 0; i < states.size(); ++i) ASSERT_EQ(bytes(states[i]), bytes(original[i])) << i;
  EXPECT_EQ(notes(file), Lines());
  EXPECT_EQ(divergence(file), divergence(press_));
}

TEST_F(OlderStates, WithoutAFieldHaveItsInitialValueAndSaySoAndAreRunAgainWithoutComparingIt) {
  const std::string file = changed([](Lines& lines) {
    for (const char* name : {"tip_force_n", "fault", "round_trip_s", "confidence"}) remove_field(lines, name);
  });
  auto original = machine_states(press_);
  const auto states = machine_states(file);
  ASSERT_EQ(states.size(), original.size());
  EXPECT_TRUE(std::any_of(original.begin(), original.end(), [](const auto& s) { return s.confidence > 0; }));
  for (std::size_t i = 0; i < states.size(); ++i) {
    original[i].tip_force_N.setZero();
    original[i].fault = {};
    original[i].round_trip_s = original[i].confidence = 0;
    ASSERT_EQ(bytes(states[i]), bytes(original[i])) << i;
  }
  const std::string lacks =
      "fault.code, fault.subject, fault.value, fault.limit, round_trip_s, tip_force_n, confidence";
  const auto told = notes(file);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_TRUE(test::says(told[0] + '\n' + told[1],
                         ": /machine/state: recorded by another version of Knuckle, without " + lacks));
  EXPECT_EQ(divergence(file), divergence(press_));
}

TEST_F(OlderStates, WithAFieldOfAnotherTypeAreRefusedInOneLine) {
  const std::string file = changed([](Lines& lines) {
    std::replace(lines.begin(), lines.end(), std::string("float64 confidence"), std::string("uint8 confidence"));
  });
  EXPECT_TRUE(test::begins(test::refusal([&] { (void)machine_states(file); }),
                           file + ": /operator/state: confidence is recorded as uint8, and is float64"));
}

TEST_F(OlderStates, WithAModeOrACodeThatNobodyKnowsAreNoStates) {
  slave::SlaveState state;
  const Lines fields = schema_lines<slave::SlaveState>().first;
  state.mode = Mode::kEStop;
  EXPECT_TRUE(decode(message_of(state, fields), state));
  state.mode = static_cast<Mode>(number_of_words(Mode{}));
  EXPECT_FALSE(decode(message_of(state, fields), state));
  state.mode = Mode::kEStop;
  state.fault.code = ReasonCode::kCount;
  EXPECT_FALSE(decode(message_of(state, fields), state));
}

const std::string kInner = std::string(80, '=') + "\nMSG: a/Inner\nuint16 code\nfloat64 limit\n";

TEST(StateTranslation, FollowsTheAlignmentOfCdrIntoStructsWithinAndFindsFieldsByTheirFormerNames) {
  const std::string today = "uint8 flag\na/Inner why\nfloat64[2] rendered_n\n" + kInner;
  const std::string recorded = "float64[2] shown_n\nbool gone\na/Inner why\nuint8 flag\n" + std::string(80, '=') +
                               "\nMSG: a/Inner\nuint16 code\n";
  std::vector<std::uint8_t> initial(64), message(64), expected(64);
  const auto write = [](std::vector<std::uint8_t>& room, const auto&... numbers) {
    CdrWriter out(room);
    (out.put(numbers), ...);
    room.resize(out.size());
  };
  write(initial, std::uint8_t{1}, std::uint16_t{2}, 3.0, 4.0, 5.0);
  write(message, 40.0, 50.0, true, std::uint16_t{20}, std::uint8_t{10});
  write(expected, std::uint8_t{10}, std::uint16_t{20}, 3.0, 40.0, 50.0);
  StateTranslation translation(recorded, today, initial, "here");
  const auto translated = translation.translated(message);
  EXPECT_EQ(std::vector<std::uint8_t>(translated.begin(), translated.end()), expected);
  EXPECT_EQ(translation.lacks(), Lines{"why.limit"});
  for (std::size_t size = 0; size < message.size(); ++size)
    EXPECT_TRUE(translation.translated(std::span(message).first(size)).empty()) << size;
  message[0] = 9;
  EXPECT_TRUE(translation.translated(message).empty()) << "another encoding";
}

TEST(StateTranslation, RefusesASchemaThatIsNoStatesNamingFileAndField) {
  for (const std::string field :
       {"string text", "uint8[] data", "float64[0] none", "float64[-1] x", "float64[ x", "float64[2",
        "float64[99999999999999999999] x", "float64[70000] x", "a/Inner[2] why", "a/Other why", "float64[2]] x"}) {
    const std::string said =
        test::refusal([&] { StateTranslation(field + " x\n" + kInner, "uint8 x\n", {}, "f: /t"); });
    EXPECT_TRUE(test::begins(said, "f: /t: schema: ")) << field;
  }
  const std::string circle = "a/A x\n" + std::string(80, '=') + "\nMSG: a/A\na/A x\na/A y\n";
  EXPECT_NE(test::refusal([&] { StateTranslation(circle, "uint8 x\n", {}, "f"); }), "accepted");
}

}  // namespace
}  // namespace knuckle::recording
