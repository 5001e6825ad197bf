// Devices that are sold, by their vendors' files: they fit, and they start.
#include <gtest/gtest.h>

#include <filesystem>

#include "app/eds/bus_command.h"
#include "app/eds/device_file.h"
#include "machine/load.h"
#include "sim/can_nodes.h"
#include "slave/canopen_client.h"
#include "tests/eds/made_device.h"
#include "tests/support/places.h"
#include "transport/virtual_can.h"

namespace knuckle::eds {
namespace {

using test::machine;
using test::shipped_text;

const std::string kDevices = test::source_dir() + "/../shared/data/devices/";

/// The shipped machine with devices that are sold in place of its valves and its tilt sensor.
MachineDescription machine_of_sold_parts(const DeviceFile& valve, const DeviceFile& tilt) {
  std::string text = shipped_text();
  for (const auto& [node, id] : {std::pair{"boom_valve", 0x10}, {"arm_valve", 0x11}, {"bucket_valve", 0x12}})
    text = with_device(text, "my.toml", node, static_cast<std::uint8_t>(id), valve);
  text = with_device(text, "my.toml", "tilt", 0x38, tilt);
  const std::string coarse = "tilt_step_deg = 0.1";
  text.replace(text.find(coarse), coarse.size(), "tilt_step_deg = 0.05");  // as it is delivered
  const std::string controller = "controller_id = 1\n";
  text.replace(text.find(controller), controller.size(), controller + "boot_timeout_ms = 4000\n");
  return parse_machine(text, "my.toml");
}

TEST(SoldDevices, StartAsTheyAreDeliveredAndAgainAfterAFaultWithoutASecondBoot) {
  if (!std::filesystem::exists(test::source_dir() + "/../shared"))
    GTEST_SKIP() << "NOT TESTED: devices that are sold: no ../shared";
  const DeviceFile valve = read_device_file(kDevices + "PVED-CC.eds"),
                   tilt = read_device_file(kDevices + "DST-X720.eds");
  EXPECT_TRUE(fit_of(valve, machine(), "boom_valve").obstacles.empty());
  EXPECT_TRUE(fit_of(tilt, machine(), "tilt").obstacles.empty());
  const MachineDescription sold = machine_of_sold_parts(valve, tilt);
  VirtualCanBus bus(2, sold.bus.bit_rate);
  sim::CanNodes nodes(sold, {}, bus.port(1), 1);
  for (const std::uint8_t id : std::initializer_list<std::uint8_t>{0x10, 0x11, 0x12})
    nodes.node(id)->become(dictionary(valve, id));
  nodes.node(0x38)->become(dictionary(tilt, 0x38));
  for (const NodeDescription& node : sold.bus.nodes) nodes.node(node.id)->set_boot_time(3s);
  slave::CanopenClient client(sold, bus.port(0));
  Time now{1s};
  const auto starts = [&](Duration most) {
    for (const Time end = now + most; now < end && !client.operational();) {
      now += 1ms;
      nodes.step(now, {});
      bus.advance(now);
      if (now.time_since_epoch() % 5ms != 0ms) continue;
      for (CanFrame frame; bus.port(0).receive(frame);) client.receive(frame, now);
      client.begin_step(now);
      client.end_step({}, false, now);
    }
    return client.operational();
  };
  ASSERT_TRUE(starts(6s)) << text(client.fault()) << text(client.setup_failure(), client.bus());
  EXPECT_EQ(nodes.node(0x10)->value(canopen::kRpdo1Timer), 50U) << "its one guard";
  EXPECT_EQ(nodes.node(0x38)->value(canopen::kTpdo1Type), 2U);
  client.restart();
  EXPECT_TRUE(starts(2s)) << text(client.fault()) << text(client.setup_failure(), client.bus());
}

}  // namespace
}  // namespace knuckle::eds
