// Devices that have what a node's start-up wants, for the shipped machine.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "app/eds/bus_command.h"
#include "app/eds/device_file.h"
#include "machine/bus_frames.h"
#include "machine/load.h"
#include "slave/node_setup.h"
#include "tests/eds/machine_texts.h"
#include "tests/support/refusal.h"

namespace knuckle::test {

inline MachineDescription machine() {
  return parse_machine(shipped_text(), "my.toml");
}

/// As CiA 301 numbers it.
inline std::uint16_t type_of(const FrameField& field) {
  const std::uint16_t size = field.bits.bits == 8 ? 0 : field.bits.bits == 16 ? 1 : 2;
  if (field.bits.type == BitField::Type::kFloat) return 8;
  return static_cast<std::uint16_t>((field.bits.type == BitField::Type::kSigned ? 2 : 5) + size);
}

/// A device that has all that the start-up of this node writes, asks for and maps.
inline eds::DeviceFile made_for(const std::string& node, const MachineDescription& of = machine()) {
  eds::DeviceFile device;
  device.source = "a.eds";
  const auto scripts = slave::node_scripts(of);
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
  for (const BusFrame& frame : bus_frames(of.bus, of.sensors)) {
    if (of.bus.nodes[frame.node].name != node) continue;
    for (const FrameField& field : frame.fields) {
      eds::Entry& entry = device.entries[std::uint32_t{field.object.index} << 8 | field.object.subindex];
      entry.data_type = type_of(field);
      if (frame.to_node) entry.access = eds::Access::kReadWrite;
      if (!entry.value) entry.value = eds::Value{};
    }
  }
  device.device_type = script->node.device_type;
  device.vendor = 0x1234;
  device.product = 0x5678;
  return device;
}
/// A device in which a PDO of the node has this identifier and cannot be moved.
inline eds::DeviceFile with_fixed(eds::DeviceFile device, std::uint32_t cob_id, std::int64_t frame) {
  device.entries[cob_id].access = eds::Access::kReadOnly;
  device.entries[cob_id].value = eds::Value{frame, true};
  return device;
}
inline std::string refused(const std::string& node, std::uint8_t id, const eds::DeviceFile& device,
                           const std::string& text = shipped_text()) {
  return refusal([&] { return eds::with_device(text, "my.toml", node, id, device); });
}

/// The file that says so, of a device by this name.
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
