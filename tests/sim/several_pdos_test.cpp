// Nodes with several transmit PDOs, and a pressure transmitter of several channels on one of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "sim/can_nodes.h"
#include "tests/sim/can_rig.h"

namespace knuckle::sim::rig {
namespace {

using canopen::Object;
using canopen::SdoAbort;
using canopen::SdoResponse;

constexpr std::uint8_t kTransmitter = 0x20;
constexpr std::size_t kChannels = 6;

Object of_channel(Object first, std::size_t channel) {
  return {first.index, static_cast<std::uint8_t>(channel)};
}
Object parameter(std::size_t pdo, std::uint8_t subindex) {
  return {static_cast<std::uint16_t>(0x1800 + pdo - 1), subindex};
}
Object map_entry(std::size_t pdo, std::uint8_t subindex) {
  return {static_cast<std::uint16_t>(0x1A00 + pdo - 1), subindex};
}

/// A controller and one node, by SDO and in time.
class NodeRig : public BusRig {
 public:
  using Step = std::function<void(Time, Outbox&)>;
  NodeRig(NodeProtocol& node, Step step_node) : protocol(node), step_node_(std::move(step_node)) {
    step = [this](Time at) {
      out_.count = 0;
      CanFrame frame;
      while (bus.port(1).receive(frame)) protocol.receive(frame, at, out_);
      step_node_(at, out_);
      for (std::size_t i = 0; i < out_.count; ++i) bus.port(1).send(out_.frames[i]);
    };
    tick();
  }
  SdoAbort write(Object object, std::uint32_t value, std::uint8_t size) {
    const auto response = ask(canopen::sdo_download(protocol.id(), object, value, size));
    EXPECT_TRUE(response);
    return !response ? SdoAbort::kTimeout : response->abort;
  }
  std::uint32_t read(Object object) {
    const auto response = ask(canopen::sdo_upload(protocol.id(), object));
    EXPECT_TRUE(response && response->kind == SdoResponse::Kind::kUploaded)
        << std::hex << object.index << ":" << int{object.subindex};
    return response ? response->value : 0;
  }
  SdoAbort refused(Object object) {
    const auto response = ask(canopen::sdo_upload(protocol.id(), object));
    return response ? response->abort : SdoAbort::kTimeout;
  }
  /// As CiA 301 has it. @return what refused one of the writes.
  SdoAbort set_up(std::size_t pdo, std::uint32_t cob_id, const std::vector<std::uint32_t>& entries,
                  std::uint8_t type = 1) {
    SdoAbort refusal = write(parameter(pdo, 1), canopen::kPdoDisabled | cob_id, 4);
    const auto then = [&](Object object, std::uint32_t value, std::uint8_t size) {
      if (refusal == SdoAbort::kNone) refusal = write(object, value, size);
    };
    then(parameter(pdo, 2), type, 1);
    then(map_entry(pdo, 0), 0, 1);
    for (std::size_t i = 0; i < entries.size(); ++i)
      then(map_entry(pdo, static_cast<std::uint8_t>(i + 1)), entries[i], 4);
    then(map_entry(pdo, 0), static_cast<std::uint32_t>(entries.size()), 1);
    then(parameter(pdo, 1), cob_id, 4);
    return refusal;
  }
  void operate() { send(canopen::nmt_frame(canopen::NmtCommand::kStart, protocol.id())); }
  std::vector<CanFrame> since(std::size_t before) const {
    std::vector<CanFrame> frames;
    for (std::size_t i = before; i < heard.size(); ++i) {
      if (heard[i].frame.id != canopen::kSyncId) frames.push_back(heard[i].frame);
    }
    return frames;
  }
  /// All that the node sends after one SYNC.
  std::vector<CanFrame> after_a_sync() {
    const std::size_t before = heard.size();
    send(canopen::sync_frame());
    run(5ms);
    return since(before);
  }

  NodeProtocol& protocol;

 private:
  Step step_node_;
  Outbox out_;
};

/// Channel n is at 10 n bar.
std::vector<SensorNode::Sample> samples_of(unsigned channels) {
  std::vector<SensorNode::Sample> samples(channels);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i].value = 1e5 * static_cast<double>(10 * (i + 1));
  return samples;
}

NodeDescription transmitter() {
  NodeDescription node;
  node.id = kTransmitter;
  node.device_type = 404;
  node.vendor = 0x1234;
  node.product = 0x5620;
  return node;
}

struct Transmitter {
  explicit Transmitter(unsigned channels = kChannels)
      : samples(samples_of(channels)),
        node(SensorNode::Kind::kPressure, transmitter(), 0, 400e5, {.pressure_digits = 1}, channels),
        rig(node.protocol(), [this](Time at, Outbox& out) { node.step(at, samples, out); }) {}
  /// Two channels in each of three PDOs, 16 bits and a status of each.
  void map_pairs() {
    for (std::size_t pdo = 1; pdo <= 3; ++pdo) {
      std::vector<std::uint32_t> entries;
      for (const std::size_t channel : {2 * pdo - 1, 2 * pdo}) {
        entries.push_back(canopen::mapping(of_channel(canopen::kPressureShort, channel), 16));
        entries.push_back(canopen::mapping(of_channel(canopen::kPressureStatus, channel), 8));
      }
      ASSERT_EQ(rig.set_up(pdo, canopen::tpdo_id(kTransmitter, static_cast<unsigned>(pdo)), entries), SdoAbort::kNone)
          << pdo;
    }
    rig.operate();
    rig.run(2ms);
  }
  std::vector<SensorNode::Sample> samples;
  SensorNode node;
  NodeRig rig;
};

/// Of the pairs: what channel (1 to 6) reads, and its status.
int short_of(const std::vector<CanFrame>& frames, std::size_t channel) {
  const auto& data = frames.at((channel - 1) / 2).data;
  const std::size_t at = (channel - 1) % 2 * 3;
  return static_cast<std::int16_t>(data[at] | data[at + 1] << 8);
}
int status_of(const std::vector<CanFrame>& frames, std::size_t channel) {
  return frames.at((channel - 1) / 2).data[(channel - 1) % 2 * 3 + 2];
}

TEST(SeveralPdos, TheFurtherOnesAreDisabledAndEmptyAsDelivered) {
  Transmitter transmitter;
  NodeRig& rig = transmitter.rig;
  EXPECT_EQ(rig.read(parameter(1, 1)), 0x1A0U);
  const std::uint32_t ids[]{0x2A0, 0x3A0, 0x4A0};
  for (std::size_t pdo = 2; pdo <= 4; ++pdo) {
    EXPECT_EQ(rig.read(parameter(pdo, 1)), canopen::kPdoDisabled | ids[pdo - 2]);
    EXPECT_EQ(rig.read(map_entry(pdo, 0)), 0U);
    EXPECT_EQ(rig.read(map_entry(pdo, 8)), 0U);
  }
  EXPECT_EQ(rig.refused(parameter(5, 1)), SdoAbort::kNoObject);
  EXPECT_EQ(rig.refused(map_entry(4, 9)), SdoAbort::kNoSubindex);
  rig.operate();
  rig.run(2ms);
  const auto frames = rig.after_a_sync();
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0x1A0U);
  EXPECT_EQ(bytes(frames[0]), (std::vector<int>{100, 0, 0, 0, 0}));  // channel 1 alone, 32 bits
}

TEST(SeveralPdos, SixChannelsInThreeOfTwoAreAllSentAfterEachSync) {
  Transmitter transmitter;
  transmitter.map_pairs();
  transmitter.samples[1].value = -12e5;  // below the range
  transmitter.samples[4].value = 500e5;  // beyond it
  for (int n = 0; n < 3; ++n) {
    const auto frames = transmitter.rig.after_a_sync();
    ASSERT_EQ(frames.size(), 3U);
    EXPECT_EQ(frames[0].id, 0x1A0U);
    EXPECT_EQ(frames[1].id, 0x2A0U);
    EXPECT_EQ(frames[2].id, 0x3A0U);
    EXPECT_EQ(bytes(frames[0]), (std::vector<int>{0x64, 0, 0, 0x88, 0xFF, canopen::kPressureUnderload}));
    EXPECT_EQ(bytes(frames[1]), (std::vector<int>{0x2C, 0x01, 0, 0x90, 0x01, 0}));
    EXPECT_EQ(bytes(frames[2]), (std::vector<int>{0x88, 0x13, canopen::kPressureOverload, 0x58, 0x02, 0}));
  }
}

TEST(SeveralPdos, EachHasItsOwnIdentifierTypeAndTimer) {
  Transmitter transmitter;
  NodeRig& rig = transmitter.rig;
  const auto map_of = [](std::size_t channel) {
    return std::vector<std::uint32_t>{canopen::mapping(of_channel(canopen::kPressureFloat, channel), 32)};
  };
  ASSERT_EQ(rig.set_up(1, 0x1A0, map_of(1), 2), SdoAbort::kNone);
  ASSERT_EQ(rig.set_up(2, 0x2B5, map_of(2), 3), SdoAbort::kNone);
  ASSERT_EQ(rig.set_up(3, 0x3A0, map_of(3), canopen::kEventDriven), SdoAbort::kNone);
  ASSERT_EQ(rig.write(parameter(3, 5), 40, 2), SdoAbort::kNone);
  ASSERT_EQ(rig.set_up(4, 0x4A0, map_of(4)), SdoAbort::kNone);
  ASSERT_EQ(rig.write(parameter(4, 1), canopen::kPdoDisabled | 0x4A0, 4), SdoAbort::kNone);
  rig.operate();
  rig.run(2ms);
  const std::size_t before = rig.heard.size();
  for (int n = 0; n < 24; ++n) rig.after_a_sync();  // 120 ms
  std::map<std::uint32_t, int> sent;
  for (const CanFrame& frame : rig.since(before)) ++sent[frame.id];
  EXPECT_EQ(sent, (std::map<std::uint32_t, int>{{0x1A0, 12}, {0x2B5, 8}, {0x3A0, 3}}));
  // Another type begins to count anew, that of one PDO alone: after 24 SYNCs the next fifth would be the next one.
  ASSERT_EQ(rig.write(parameter(2, 2), 5, 1), SdoAbort::kNone);
  std::vector<bool> second;
  for (int n = 0; n < 5; ++n) {
    const auto frames = rig.after_a_sync();
    second.push_back(std::any_of(frames.begin(), frames.end(), [](const CanFrame& f) { return f.id == 0x2B5; }));
  }
  EXPECT_EQ(second, (std::vector<bool>{false, false, false, false, true}));
}

TEST(SeveralPdos, AnEventDrivenOneIsSentWhenItsValueChangesWhateverTheOthersWaitFor) {
  Transmitter transmitter;
  NodeRig& rig = transmitter.rig;
  ASSERT_EQ(rig.set_up(2, 0x2A0, {canopen::mapping(of_channel(canopen::kPressureShort, 5), 16)}, canopen::kEventDriven),
            SdoAbort::kNone);
  rig.operate();
  rig.run(5ms);
  const std::size_t before = rig.heard.size();
  transmitter.samples[4].value = 1e5;
  rig.run(5ms);
  const auto frames = rig.since(before);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0x2A0U);
  EXPECT_EQ(bytes(frames[0]), (std::vector<int>{10, 0}));
}

TEST(SeveralPdos, AMapOfMoreThanEightBytesOrEntriesIsRefused) {
  Transmitter transmitter;
  NodeRig& rig = transmitter.rig;
  std::vector<std::uint32_t> entries;
  for (std::size_t channel = 1; channel <= 3; ++channel)
    entries.push_back(canopen::mapping(of_channel(canopen::kPressureValue, channel), 32));
  for (const std::size_t pdo : {std::size_t{1}, std::size_t{3}})
    EXPECT_EQ(rig.set_up(pdo, 0x3A0, entries), SdoAbort::kPdoTooLong);
  EXPECT_EQ(static_cast<std::uint32_t>(SdoAbort::kPdoTooLong), 0x06040042U);
  EXPECT_EQ(rig.write(map_entry(2, 0), 9, 1), SdoAbort::kPdoTooLong);
  entries.assign(8, canopen::mapping(canopen::kPressureStatus, 8));
  EXPECT_EQ(rig.set_up(2, 0x2A0, entries), SdoAbort::kNone);
  EXPECT_EQ(rig.write(map_entry(2, 1), entries[0], 4), SdoAbort::kUnsupportedAccess) << "while it is enabled";
  EXPECT_EQ(rig.write(parameter(2, 1), 0x123, 4), SdoAbort::kInvalidValue);
  EXPECT_EQ(rig.write(parameter(2, 2), 250, 1), SdoAbort::kInvalidValue);
}

TEST(PressureChannels, AFaultIsTheWholeNodes) {
  Transmitter transmitter;
  transmitter.map_pairs();
  NodeRig& rig = transmitter.rig;
  const auto set_all = [&](double pressure_Pa) {
    for (auto& sample : transmitter.samples) sample.value = pressure_Pa;
  };
  const auto expect_all = [](const std::vector<CanFrame>& frames, int value, int status, const char* what) {
    ASSERT_EQ(frames.size(), 3U) << what;
    for (std::size_t n = 1; n <= kChannels; ++n) {
      EXPECT_EQ(short_of(frames, n), value) << what << ", channel " << n;
      EXPECT_EQ(status_of(frames, n), status) << what << ", channel " << n;
    }
  };
  set_all(100e5);
  expect_all(rig.after_a_sync(), 1000, 0, "sound");
  transmitter.node.inject(NodeFault::kFrozen, rig.now);
  set_all(120e5);
  expect_all(rig.after_a_sync(), 1000, 0, "frozen");
  transmitter.node.inject(NodeFault::kInvalid, rig.now);
  expect_all(rig.after_a_sync(), 0x7FFF, canopen::kPressureInvalid, "invalid");
  EXPECT_TRUE(std::isnan(std::bit_cast<float>(rig.read(of_channel(canopen::kPressureFloat, kChannels)))));
  EXPECT_EQ(rig.read(of_channel(canopen::kPressureValue, kChannels)), 0x7FFFFFFFU);
  transmitter.node.inject(NodeFault::kSpike, rig.now);
  expect_all(rig.after_a_sync(), 2700, 0, "spike");
  expect_all(rig.after_a_sync(), 1200, 0, "after the spike");
  transmitter.node.inject(NodeFault::kNone, rig.now);
  expect_all(rig.after_a_sync(), 1200, 0, "sound again");
}

}  // namespace
}  // namespace knuckle::sim::rig
