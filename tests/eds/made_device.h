// Devices for `knuckle bus add` that have what start-up wants, to be spoilt by a test; and their files.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "app/eds/bus_command.h"
#include "machine/bus_frames.h"
#include "machine/load.h"
#include "slave/node_setup.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {

inline std::string solar_text() {
  return content(source_dir() + "/config/machines/solar015.toml");
}
inline MachineDescription solar_file() {
  return parse_machine(solar_text(), "my.toml");
}

/// A device that has all that the start-up of this node writes, asks for and maps.
inline eds::DeviceFile device_for(const std::string& node, const MachineDescription& machine = solar_file()) {
  eds::DeviceFile device;
  device.source = "a.eds";
  const auto scripts = slave::node_scripts(machine);
  const auto script =
      std::find_if(scripts.begin(), scripts.end(), [&](const auto& one) { return one.node.name == node; });
  for (const slave::SetupPart& part : script->script) {
    for (const slave::SdoStep& step : part.asked) {
      eds::Entry& entry = device.entries[std::uint32_t{step.object.index} << 8 | step.object.subindex];
      entry.data_type = step.size == 1 ? 5 : step.size == 2 ? 6 : 7;
      entry.access = part.written.empty() ? eds::Access::kReadOnly : eds::Access::kReadWrite;
      entry.value = eds::Value{step.value, false};
      entry.line = 1;
    }
  }
  for (const BusFrame& frame : bus_frames(machine.bus, machine.sensors)) {
    if (machine.bus.nodes[frame.node].name != node) continue;
    for (const FrameField& field : frame.fields) {
      eds::Entry& entry = device.entries[std::uint32_t{field.object.index} << 8 | field.object.subindex];
      const auto is_it = [&](const eds::DataType& one) {
        return one.number > 1 && one.bytes * 8 == field.bits.bits && one.type == field.bits.type;
      };
      entry.data_type = std::find_if(eds::kDataTypes.begin(), eds::kDataTypes.end(), is_it)->number;
      if (frame.to_node) entry.access = eds::Access::kReadWrite;
      if (!entry.value) entry.value = eds::Value{};
    }
  }
  device.device_type = script->node.device_type;
  device.vendor = 0x1234;
  device.product = 0x5678;
  return device;
}

inline std::string eds_text(const eds::DeviceFile& device) {
  std::string text = "[DeviceInfo]\nVendorName=Maker\nProductName=Device\n";
  for (const auto& [key, entry] : device.entries) {
    const std::uint32_t value = key == 0x101801   ? device.vendor
                                : key == 0x101802 ? device.product
                                                  : entry.value.value_or(eds::Value{}).of(0);
    text += fmt::format("[{:04X}sub{:X}]\nDataType={}\nAccessType={}\nDefaultValue=0x{:X}\n", key >> 8, key & 0xFF,
                        entry.data_type, entry.access == eds::Access::kReadWrite ? "rw" : "ro", value);
  }
  return text;
}

}  // namespace knuckle::test
