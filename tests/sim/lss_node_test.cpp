// A simulated device's side of LSS: silent without a node id, found by its identity, started with the id it was given.
#include "sim/lss_node.h"

#include <gtest/gtest.h>

#include <initializer_list>

#include "tests/sim/can_rig.h"

namespace knuckle::sim {
namespace {

using lss::Service;
using rig::CanRig;

constexpr std::uint8_t kNode = 0x20;  // a pressure transmitter; vendor 0x1234, product 0x5620

/// The newest answer over LSS to what is sent.
std::optional<lss::Message> ask(CanRig& rig, Service service, std::uint32_t value = 0) {
  const Time sent = rig.now;
  rig.send(lss::request(service, value));
  rig.run(4ms);
  const auto answer = rig.newest(lss::kAnswerId, sent);
  return answer ? lss::parse_answer(answer->frame) : std::nullopt;
}
std::optional<lss::Message> select(CanRig& rig, std::uint32_t serial) {
  ask(rig, Service::kSelectVendor, 0x1234);
  ask(rig, Service::kSelectProduct, 0x5620);
  ask(rig, Service::kSelectRevision, 0);
  return ask(rig, Service::kSelectSerial, serial);
}
NodeProtocol& without_id(CanRig& rig) {
  NodeProtocol& node = *rig.nodes.node(kNode);
  node.set_serial(77);
  node.start_as(lss::kNoNodeId);
  return node;
}

TEST(LssNode, ADeviceWithoutNodeIdSendsNothingAndAnswersNoServiceButLss) {
  CanRig rig;
  without_id(rig);
  rig.run(50ms);
  for (const std::uint32_t id : {canopen::heartbeat_id(kNode), canopen::heartbeat_id(0x7F), canopen::emcy_id(0x7F)})
    EXPECT_FALSE(rig.newest(id)) << id;
  EXPECT_TRUE(rig.newest(canopen::heartbeat_id(0x21))) << "another one";
  EXPECT_FALSE(rig.ask(canopen::sdo_upload(kNode, canopen::kDeviceType)));
  rig.send(canopen::nmt_frame(canopen::NmtCommand::kStart, 0));
  rig.syncing = true;
  rig.run(50ms);
  EXPECT_FALSE(rig.newest(canopen::tpdo1_id(kNode)));
  EXPECT_EQ(ask(rig, Service::kIdentifyUnconfigured), (lss::Message{Service::kUnconfigured, 0}));
}

TEST(LssNode, IsFoundByAllFourOfItsNumbersAndByTheirBounds) {
  CanRig rig;
  NodeProtocol& node = without_id(rig);
  rig.tick();
  EXPECT_FALSE(ask(rig, Service::kAskSerial)) << "waiting";
  EXPECT_FALSE(select(rig, 78));
  EXPECT_EQ(select(rig, 77), (lss::Message{Service::kSelected, 0}));
  EXPECT_FALSE(node.lss().waiting());
  EXPECT_TRUE(rig.nodes.node(0x21)->lss().waiting());
  EXPECT_EQ(ask(rig, Service::kAskSerial)->value, 77U);
  EXPECT_EQ(ask(rig, Service::kAskVendor)->value, 0x1234U);
  EXPECT_EQ(ask(rig, Service::kAskProduct)->value, 0x5620U);
  EXPECT_EQ(ask(rig, Service::kAskNodeId)->value, lss::kNoNodeId);
  struct Bounds {
    std::uint32_t product, low, high;
    bool within;
  };
  for (const auto& [product, low, high, within] :
       {Bounds{0x5620, 77, 77, true}, Bounds{0x5620, 0, 76, false}, Bounds{0x5620, 78, 0xFFFFFFFF, false},
        Bounds{0x5620, 0, 0xFFFFFFFF, true}, Bounds{0x5621, 77, 77, false}}) {
    ask(rig, Service::kIdentifyVendor, 0x1234);
    ask(rig, Service::kIdentifyProduct, product);
    ask(rig, Service::kIdentifyRevisionLow, 0);
    ask(rig, Service::kIdentifyRevisionHigh, 0xFFFFFFFF);
    ask(rig, Service::kIdentifySerialLow, low);
    EXPECT_EQ(ask(rig, Service::kIdentifySerialHigh, high).has_value(), within) << product << ' ' << low << ' ' << high;
  }
}

TEST(LssNode, StartsWithItsFirstNodeIdWhenItIsLeftAndWithALaterOneAtAReset) {
  CanRig rig;
  NodeProtocol& node = without_id(rig);
  rig.tick();
  ASSERT_TRUE(select(rig, 77));
  EXPECT_EQ(ask(rig, Service::kConfigureNodeId, 0)->code(), 1) << "out of range";
  EXPECT_EQ(ask(rig, Service::kConfigureNodeId, 128)->code(), 1);
  EXPECT_EQ(ask(rig, Service::kConfigureNodeId, 0x2A)->code(), 0);
  EXPECT_FALSE(rig.newest(canopen::heartbeat_id(0x2A))) << "not before it is left";
  EXPECT_EQ(node.lss().stored(), lss::kNoNodeId);
  EXPECT_EQ(ask(rig, Service::kStore)->code(), 0);
  EXPECT_EQ(node.lss().stored(), 0x2A);
  ask(rig, Service::kSwitchAll, 0);
  ASSERT_TRUE(rig.newest(canopen::heartbeat_id(0x2A)));
  EXPECT_EQ(rig.ask(canopen::sdo_upload(0x2A, canopen::kTpdo1CobId))->value, 0x1AAU) << "its PDO has moved";
  EXPECT_EQ(rig.ask(canopen::sdo_upload(0x2A, canopen::kSerialNumber))->value, 77U);

  ASSERT_TRUE(select(rig, 77));
  ask(rig, Service::kConfigureNodeId, 0x2B);
  ask(rig, Service::kSwitchAll, 0);
  EXPECT_TRUE(rig.ask(canopen::sdo_upload(0x2A, canopen::kDeviceType)));
  rig.send(canopen::nmt_frame(canopen::NmtCommand::kResetCommunication, 0x2A));
  rig.run(5ms);
  EXPECT_TRUE(rig.newest(canopen::heartbeat_id(0x2B)));
  EXPECT_FALSE(rig.ask(canopen::sdo_upload(0x2A, canopen::kDeviceType)));
  EXPECT_EQ(node.lss().stored(), 0x2A) << "until it is told to store";
}

TEST(LssNode, DoesNotAnswerLssWhileItBoots) {
  CanRig rig;
  rig.nodes.node(kNode)->set_boot_time(20ms);
  rig.tick();
  EXPECT_FALSE(select(rig, 0));
  rig.run(20ms);
  EXPECT_TRUE(select(rig, 0));
}

TEST(LssNode, AnIdKeptInObjectsIsTakenAtAResetWhereAllOfThemAgree) {
  CanRig rig;
  NodeProtocol& node = *rig.nodes.node(kNode);
  const canopen::Object a{0x20F0, 0}, b{0x20F1, 0};
  node.add(a, 1, Access::kReadWrite, kNode);
  node.add(b, 1, Access::kReadWrite, kNode);
  node.keep_id_in({a, b});
  rig.tick();
  rig.ask(canopen::sdo_download(kNode, a, 0x2A, 1));
  rig.send(canopen::nmt_frame(canopen::NmtCommand::kResetNode, kNode));
  rig.run(5ms);
  EXPECT_EQ(node.id(), kNode);
  rig.ask(canopen::sdo_download(kNode, b, 0x2A, 1));
  EXPECT_EQ(node.id(), kNode) << "not before it starts anew";
  rig.send(canopen::nmt_frame(canopen::NmtCommand::kResetNode, kNode));
  rig.run(5ms);
  EXPECT_TRUE(rig.newest(canopen::heartbeat_id(0x2A)));
  EXPECT_EQ(rig.ask(canopen::sdo_upload(0x2A, canopen::kTpdo1CobId))->value, 0x1AAU);
}

}  // namespace
}  // namespace knuckle::sim
