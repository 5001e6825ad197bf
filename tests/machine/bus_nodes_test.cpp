// Nodes that say what their channels are ([[bus.node]]), and the frames that follow from it.
#include <gtest/gtest.h>

#include "machine/bus_frames.h"
#include "tests/support/axes_machine.h"
#include "tests/support/few_nodes.h"
#include "tests/support/patterns.h"
#include "tests/support/refused_changes.h"
#include "tests/support/replaced.h"
#include "tests/support/shipped.h"

namespace knuckle {
namespace {

MachineDescription listed_with(const std::string& from = "", const std::string& to = "") {
  return parse_machine(test::replaced(test::few_nodes_text(), from, to), "m.toml");
}
/// Without file and line.
std::string said_of(const std::string& text) {
  return test::with_match_replaced(test::machine_refusal(text), "^m.toml:[0-9]+: ", "");
}
std::string refusal_with(const std::string& from, const std::string& to) {
  return said_of(test::replaced(test::few_nodes_text(), from, to));
}
std::vector<BusFrame> frames_of(const MachineDescription& machine, NodeRole role) {
  std::vector<BusFrame> frames = bus_frames(machine.bus, machine.sensors);
  std::erase_if(frames, [&](const BusFrame& frame) { return machine.bus.nodes[frame.node].role != role; });
  return frames;
}

TEST(BusNodes, EachSignalIsOfTheNodeWhoseChannelItIs) {
  const BusDescription bus = listed_with().bus;
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
  const MachineDescription machine = listed_with();
  const std::vector<BusFrame> frames = frames_of(machine, NodeRole::kPressure);
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
  const MachineDescription machine = listed_with();
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

TEST(BusNodes, WhatADeviceMapsByItselfIsReadWhereItLies) {
  const std::string tilt = "name = \"tilt\"";
  const auto with = [&tilt](const std::string& keys) {
    return test::replaced(test::few_nodes_text(), tilt, keys + "\n" + tilt);
  };
  const MachineDescription machine =
      parse_machine(with("tpdo_map = [0x20000120, 0x60200010]\ntpdo2_map = [0x20020008, 0x60100010]"), "m.toml");
  const std::vector<BusFrame> frames = frames_of(machine, NodeRole::kTilt);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[0].bytes(), 6);
  EXPECT_TRUE(frames[0].fields.empty());
  EXPECT_EQ(frames[1].bytes(), 3);
  EXPECT_EQ(frames[1].id, frames[0].id + 0x100);
  ASSERT_EQ(frames[1].fields.size(), 1U);
  EXPECT_EQ(frames[1].fields[0].bits.start_bit, 8);

  for (const auto& [keys, said] :
       {std::pair{"tpdo_map = [0x20000120]", "must have 0x60100010 (slope), or tpdo2_map to tpdo4_map must"},
        {"tpdo_map = [0x20000107, 0x60100010]", "has 23 bits: must be whole bytes, 8 at most"},
        {"tpdo_map = [0x20000120, 0x60100010, 0x20000120]", "has 80 bits"},
        {"tpdo_map = [1.5]", ": has 1.5: must be whole numbers, such as 0x61300120"},
        {"tpdo_map = [0x60100010, 0x20000100]", ": has 0x20000100, which is 0 bits: must be at least 1"},
        {"tpdo_map = [0x60100010, 0x60100010]", ": has 0x60100010 twice"},
        {"tpdo_map = [0x60100010]\ntpdo2_map = [0x60100010]", ": has 0x60100010, which an earlier map has, too"}})
    EXPECT_TRUE(test::says(said_of(with(keys)), said));
}

TEST(BusNodes, EachAxisOfAValveHasItsObjectsAndThePdosOfItsNumber) {
  const std::string text = test::axes_text("{ 1 = \"arm_spool\", 2 = \"bucket_spool\", 4 = \"boom_spool\" }",
                                           "rpdo2 = 0x2F0\ntpdo4 = 0x4F1\n");
  const MachineDescription machine = parse_machine(text, "m.toml");
  EXPECT_EQ(machine.bus.valve(kBoom).joint(), -1) << "of several joints";
  constexpr int kAxis[] = {4, 1, 2};
  constexpr std::uint32_t kTold[] = {0x510, 0x210, 0x2F0}, kHeard[] = {0x4F1, 0x190, 0x290};
  int seen = 0;
  for (const BusFrame& frame : frames_of(machine, NodeRole::kValve)) {
    const NodeChannel& channel = frame.fields[0].channel;
    const auto joint = static_cast<std::size_t>(channel.info().index);
    EXPECT_EQ(channel.number, kAxis[joint]);
    EXPECT_EQ(frame.pdo, kAxis[joint] - 1);
    EXPECT_EQ(frame.id, frame.to_node ? kTold[joint] : kHeard[joint]);
    EXPECT_EQ(frame.id, frame.to_node ? machine.bus.set_point_id(joint) : machine.bus.spool_id(joint));
    const int shift = 0x800 * (kAxis[joint] - 1);
    EXPECT_EQ(frame.fields[0].object.index, (frame.to_node ? 0x6040 : 0x6041) + shift);
    EXPECT_EQ(frame.fields[1].object.index, (frame.to_node ? 0x6300 : 0x6301) + shift);
    EXPECT_EQ(frame.fields[1].object.subindex, 1);
    EXPECT_EQ(frame.bytes(), 4);
    ++seen;
  }
  EXPECT_EQ(seen, 6);
}

TEST(BusNodes, TheSlopeMayBeThatOfATiltSensorsSecondAxis) {
  const auto frames = frames_of(listed_with("1 = \"slope\"", "2 = \"slope\""), NodeRole::kTilt);
  ASSERT_EQ(frames.size(), 1U);
  ASSERT_EQ(frames[0].fields.size(), 1U);
  EXPECT_EQ(frames[0].fields[0].object, (canopen::Object{0x6020, 0}));
}

TEST(BusNodes, WrongAxesAreRefusedWithFileLineAndKey) {
  struct Case {
    std::string channels, said, keys;
  };
  for (const Case& c :
       {Case{
            "{ 0 = \"boom_spool\", 2 = \"arm_spool\", 3 = \"bucket_spool\" }",
            "key 'bus.node[0].channels.0' = 'boom_spool': must be an axis from 1 to 4: each has PDOs of its own, and a "
            "node has 4",
            ""},
        {"{ 1 = \"boom_spool\", 2 = \"arm_spool\", 9 = \"bucket_spool\" }",
         "key 'bus.node[0].channels.9' = 'bucket_spool': must be an axis from 1 to 4: each has PDOs of its own, and a "
         "node has 4",
         ""},
        {"{ 1 = \"boom_spool\", 2 = \"arm_spool\", 3 = \"bucket_spool\", 4 = \"arm_spool\" }",
         "key 'bus.node[0].channels.4' = 'arm_spool': is taken by 'valves'", ""},
        {test::kThreeAxes, "key 'bus.node[0].rpdo3' = 0x310: its frames' identifier 0x310 is taken by 'valves.rpdo2'",
         "rpdo3 = 0x310\n"},
        {test::kThreeAxes, "key 'bus.node[0].rpdo4' = 0x2F0: unknown key; did you mean 'rpdo'?", "rpdo4 = 0x2F0\n"}}) {
    const std::string text = test::axes_text(c.channels, c.keys);
    EXPECT_EQ(said_of(text), c.said);
    EXPECT_TRUE(test::begins(test::machine_refusal(text), "m.toml:1"));
  }
}

TEST(BusNodes, ANodeIsFoundByItsNameItsSignalAndWhatScenariosCallIt) {
  const BusDescription bus = listed_with("name = \"arm_valve\"", "name = \"second_spool\"").bus;
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
  EXPECT_TRUE(test::says(refusal_with("name = \"arm_valve\"", "name = \"arm_length\""),
                         "is what Knuckle calls a signal that this node does not have"));
}

TEST(BusNodes, WhatCannotBeIsRefusedWithItsKey) {
  const std::vector<test::RefusedChange> cases{
      {"2 = \"bucket_rod_pressure\"", "2 = \"bucket_head_pressure\"",
       "'bus.node[0].channels.2' = 'bucket_head_pressure'"},
      {"2 = \"bucket_rod_pressure\", ", "", "no node has bucket_rod_pressure"},
      {"1 = \"boom_length\"", "2 = \"boom_length\"", "must be channel 1"},
      {"1 = \"boom_length\"", "1 = \"boom_spool\"", "must be one of \"boom_length\", \"boom_angle\", \"arm_length\""},
      {"1 = \"boom_length\"", "", "must say what channel 1 is: { 1 = \"boom_length\" }"},
      {"7 = \"arm_rod_pressure\"", "9 = \"arm_rod_pressure\"",
       "'bus.node[0].channels.9' = 'arm_rod_pressure': must be a channel from 1 to 8"},
      {"7 = \"arm_rod_pressure\"", "7 = \"arm_spool\"",
       "'bus.node[0].channels.7' = 'arm_spool': must be one of \"boom_head_pressure\""},
      {"1 = \"slope\"", "3 = \"slope\"",
       "'bus.node[8].channels.3' = 'slope': must be 1 (longitudinal, 0x6010) or 2 (lateral, 0x6020)"},
      {"profile = \"cia408\"\nid = 0x10\ndevice_type = 0x0198\nvendor = 0x4B4E\nproduct = 0x0408\nchannels = { 1",
       "profile = \"cia408/pved\"\nid = 0x10\ndevice_type = 0x0198\nvendor = 0x4B4E\nproduct = 0x0408\nchannels = { 2",
       "'bus.node[2].channels.2' = 'boom_spool': must be channel 1: a PVED-CC has one axis"},
      {"1 = \"slope\"", "\"\" = \"slope\"", "channels.' = 'slope': unknown key: must be 1 (longitudinal, 0x6010)"},
      {"1 = \"slope\"", "x = \"slope\"", "channels.x' = 'slope': unknown key: must be 1 (longitudinal, 0x6010) or 2"},
      {"device_type = 0x019A", "device_type = 0x00020194",
       "key 'bus.node[8].device_type' = 0x20194: must have 410 = 0x019A, the number of the node's profile, in its "
       "lower 16 bits; has 404"},
      {"profile = \"cia410\"", "profile = \"cia999\"", "must be one of \"cia408\", \"cia408/pved\", \"cia404\""},
      {"name = \"arm_valve\"", "name = \"boom_valve\"", "is the name of another node"},
      {"id = 0x31", "id = 0x30", "is taken by 'boom_encoder'; node ids must be unique"},
      {"name = \"pressures\"", "name = \"pressures\"\ntpdo3 = 0x1B8", "its frames' identifier 0x1B8 is taken by"},
      {"pressure_value = \"integer16\"", "pressure_value = \"integer\"", "need 6 frames, and a node has 4"},
      {"pressure_digits = 1", "pressure_digits = 2", "16 bits reach 327.67 bar"},
      {"[limits]", "[bus.nodes]\n[limits]", "stands beside [[bus.node]] tables: keep one of the two"},
      {"bit_rate_kbps = 250", "bit_rate_kbps = 125", "too slow: these frames load the bus"},
  };
  test::expect_refused(cases, listed_with);
  EXPECT_TRUE(test::says(refusal_with("1 = \"boom_length\" }", "1 = \"boom_length\", 2 = \"arm_length\" }"),
                         "'bus.node[5].channels.2' = 'arm_length': must be channel 1 (first of 2 errors"))
      << "the arm's encoder has it, too";
  for (const test::RefusedChange& c : cases)
    EXPECT_FALSE(test::says(refusal_with(c.from, c.to), "first of")) << c.to << ": one mistake is one error";
}

TEST(BusNodes, ADeviceTypeMayNameMoreThanItsProfileOrNone) {
  for (const char* type : {"0x0008019A", "0", "0x00080000", "0xFFFF0194"})
    EXPECT_NO_THROW((void)listed_with("0x019A", type)) << type;
  for (const char* type : {"0x0009", "0xFFFE0194", "0xFFFFFFF"})
    EXPECT_TRUE(test::says(refusal_with("0x019A", type), ".device_type'")) << type;
}

}  // namespace
}  // namespace knuckle
