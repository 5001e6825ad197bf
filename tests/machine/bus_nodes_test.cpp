// Nodes that say what their channels are ([[bus.node]]), and the frames that follow from it.
#include <gtest/gtest.h>

#include "machine/bus_frames.h"
#include "machine/load.h"
#include "tests/support/few_nodes.h"
#include "tests/support/patterns.h"
#include "tests/support/refusal.h"

namespace knuckle {
namespace {

std::string listed_with(const std::string& from, const std::string& to) {
  std::string text = test::few_nodes_text();
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}
/// Without file and line.
std::string refusal_with(const std::string& from, const std::string& to) {
  return test::with_match_replaced(test::refusal([&] { (void)parse_machine(listed_with(from, to), "test.toml"); }),
                                   "^test.toml:[0-9]+: ", "");
}

TEST(BusNodes, EachSignalIsOfTheNodeWhoseChannelItIs) {
  const BusDescription bus = parse_machine(test::few_nodes_text(), "test.toml").bus;
  ASSERT_EQ(bus.nodes.size(), 9U);
  EXPECT_EQ(bus.node_names(),
            "boom_valve, arm_valve, bucket_valve, pressures, boom_encoder, arm_encoder, bucket_encoder, tilt, enable");
  for (int chamber = 0; chamber < 6; ++chamber) EXPECT_EQ(bus.pressure(chamber).id, 0x20) << chamber;
  EXPECT_EQ(bus.pressure(0).joint(), -1) << "of several joints";
  EXPECT_EQ(bus.encoder(kArm).name, "arm_encoder");
  EXPECT_EQ(bus.encoder(kArm).joint(), kArm);
  EXPECT_EQ(bus.enable().joint(), -1);
  EXPECT_EQ(bus.find("arm_rod_pressure"), &bus.pressure(3)) << "by the name of the signal";
  EXPECT_EQ(bus.find("arm_valve"), &bus.valve(kArm));
  EXPECT_EQ(bus.find("nobody"), nullptr);
}

TEST(BusNodes, ChannelsFillTheirNodesFramesInTheirOrderValueAndStatusTogether) {
  const MachineDescription machine = parse_machine(test::few_nodes_text(), "test.toml");
  std::vector<BusFrame> frames;
  for (const BusFrame& frame : bus_frames(machine.bus, machine.sensors)) {
    if (machine.bus.nodes[frame.node].role == NodeRole::kPressure) frames.push_back(frame);
  }
  ASSERT_EQ(frames.size(), 3U);
  const std::uint32_t ids[] = {0x1A0, 0x2A0, 0x3A0};
  const char* const names[][2] = {{"bucket_head_pressure", "bucket_rod_pressure"},
                                  {"boom_head_pressure", "boom_rod_pressure"},
                                  {"arm_head_pressure", "arm_rod_pressure"}};
  const std::uint8_t numbers[][2] = {{1, 2}, {3, 4}, {6, 7}};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(frames[i].id, ids[i]);
    EXPECT_EQ(frames[i].bytes(), 6);
    EXPECT_EQ(frames[i].every_nth_sync, 1);
    ASSERT_EQ(frames[i].fields.size(), 4U);
    for (std::size_t c = 0; c < 2; ++c) {
      const FrameField& value = frames[i].fields[2 * c];
      const FrameField& status = frames[i].fields[2 * c + 1];
      EXPECT_STREQ(value.channel.info().name, names[i][c]);
      EXPECT_EQ(value.object, (canopen::Object{0x7130, numbers[i][c]}));
      EXPECT_EQ(status.object, (canopen::Object{0x6150, numbers[i][c]}));
      EXPECT_EQ(value.bits.start_bit, 24 * c);
      EXPECT_EQ(status.bits.start_bit, 24 * c + 16);
      EXPECT_DOUBLE_EQ(value.bits.scale, 1e4) << "0.1 bar";
    }
  }
}

TEST(BusNodes, FramesOfValvesAndEnableNodeAreThoseThatTheLoopReadsAndWrites) {
  const MachineDescription machine = parse_machine(test::few_nodes_text(), "test.toml");
  int seen = 0;
  for (const BusFrame& frame : bus_frames(machine.bus, machine.sensors)) {
    const NodeRole role = machine.bus.nodes[frame.node].role;
    if (role != NodeRole::kValve && role != NodeRole::kEnable) continue;
    const bool valve = role == NodeRole::kValve;
    const canopen::PdoMap& map = frame.to_node ? (valve ? canopen::kValveRpdo : canopen::kEnableRpdo)
                                               : (valve ? canopen::kValveTpdo : canopen::kEnableTpdo);
    ASSERT_EQ(frame.fields.size(), map.count);
    std::size_t bit = 0;
    for (std::size_t i = 0; i < map.count; ++i) {
      const FrameField& field = frame.fields[i];
      EXPECT_EQ(canopen::mapping(field.object, field.bits.bits), map.entries[i]) << i;
      EXPECT_EQ(field.bits.start_bit, bit) << i;
      bit += field.bits.bits;
    }
    ++seen;
  }
  EXPECT_EQ(seen, 8);
}

TEST(BusNodes, ANodeIsFoundByItsNameItsSignalAndWhatScenariosCallIt) {
  const std::string text = listed_with("name = \"arm_valve\"", "name = \"second_spool\"");
  const BusDescription bus = parse_machine(text, "test.toml").bus;
  for (const char* name : {"second_spool", "arm_spool", "arm_valve"}) {
    ASSERT_NE(bus.find(std::string(name)), nullptr) << name;
    EXPECT_EQ(bus.find(std::string(name))->id, 0x11) << name;
  }
  EXPECT_EQ(bus.find(std::string("third_spool")), nullptr);
}

TEST(BusNodes, ANameThatOtherFilesCouldNotSayOrThatIsAnotherNodesSignalIsRefused) {
  for (const char* name : {"boom valve", "p-1", "1st", "controller", "a_name_of_twenty_three_c", "0x20", "a=b"}) {
    EXPECT_EQ(refusal_with("name = \"arm_valve\"", "name = \"" + std::string(name) + "\""),
              "key 'bus.node[3].name' = '" + std::string(name) +
                  "': must be a letter and up to 21 letters, digits and _, and not 'controller'");
  }
  EXPECT_NE(refusal_with("name = \"arm_valve\"", "name = \"arm_length\"")
                .find("is what Knuckle calls a signal that this node does not have"),
            std::string::npos);
}

TEST(BusNodes, TooManyFramesOfANodeAreOneFault) {
  const std::string refused =
      test::refusal([] { (void)parse_machine(listed_with("pressure_value = \"integer16\"", ""), "test.toml"); });
  EXPECT_NE(refused.find("need 6 frames, and a node has 4"), std::string::npos) << refused;
  EXPECT_EQ(refused.find("more"), std::string::npos) << refused;
}

TEST(BusNodes, WhatCannotBeIsRefusedWithItsKey) {
  struct Case {
    const char *from, *to, *said;
  };
  const Case cases[] = {
      {"2 = \"bucket_rod_pressure\"", "2 = \"bucket_head_pressure\"",
       "'bus.node[0].channels.2' = 'bucket_head_pressure'"},
      {"2 = \"bucket_rod_pressure\", ", "", "no node has bucket_rod_pressure"},
      {"1 = \"boom_length\"", "2 = \"boom_length\"", "must be channel 1"},
      {"1 = \"boom_length\"", "1 = \"boom_spool\"", "must be one of \"boom_length\", \"boom_angle\", \"arm_length\""},
      {"1 = \"boom_length\"", "", "must say what channel 1 is: { 1 = \"boom_length\" }"},
      {"1 = \"boom_length\" }", "1 = \"boom_length\", 2 = \"arm_length\" }", "only nodes of cia404 may have several"},
      {"7 = \"arm_rod_pressure\"", "9 = \"arm_rod_pressure\"", "no node has arm_rod_pressure"},
      {"profile = \"cia410\"", "profile = \"cia999\"", "must be one of \"cia408\", \"cia408/pved\", \"cia404\""},
      {"name = \"arm_valve\"", "name = \"boom_valve\"", "is the name of another node"},
      {"id = 0x31", "id = 0x30", "is taken by 'boom_encoder'; node ids must be unique"},
      {"name = \"pressures\"", "name = \"pressures\"\ntpdo3 = 0x1B8", "its frames' identifier 0x1B8 is taken by"},
      {"pressure_value = \"integer16\"", "pressure_value = \"integer\"", "need 6 frames, and a node has 4"},
      {"pressure_digits = 1", "pressure_digits = 2", "16 bits reach 327.67 bar"},
      {"[limits]", "[bus.nodes]\n[limits]", "stands beside [[bus.node]] tables: keep one of the two"},
      {"bit_rate_kbps = 250", "bit_rate_kbps = 125", "too slow: these frames load the bus"},
  };
  for (const Case& c : cases)
    EXPECT_NE(refusal_with(c.from, c.to).find(c.said), std::string::npos) << refusal_with(c.from, c.to);
}

}  // namespace
}  // namespace knuckle
