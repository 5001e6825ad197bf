// A simulated device's side of LSS: silent without a node id. What is told to it over LSS is tried in tests/eds.
#include "sim/lss_node.h"

#include <gtest/gtest.h>

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
void without_id(CanRig& rig) {
  NodeProtocol& node = *rig.nodes.node(kNode);
  node.set_serial(77);
  node.start_as(lss::kNoNodeId);
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

}  // namespace
}  // namespace knuckle::sim
