// Any text as a vendor's device file: refused in one line, or objects with an identity; and as every node of a machine.
#include <cstdint>
#include <string>
#include <string_view>

#include "app/eds/bus_command.h"
#include "machine/bus_description.h"
#include "machine/load.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace knuckle;
  static const MachineDescription machine = load_machine(KNUCKLE_SOURCE_DIR "/config/machines/solar015.toml");
  static const auto nodes = machine.bus.nodes;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  test::refused_or([&] {
    const eds::DeviceFile device = eds::parse_device_file(text, "input");
    for (const auto& [key, entry] : device.entries) test::require(key <= 0xFFFFFE && entry.line > 0);
    for (const std::string& slip : device.slips) test::require_line(slip);
    for (const NodeDescription& node : nodes) {
      const eds::Fit fit = eds::fit_of(device, machine, node.name);
      for (const std::string& obstacle : fit.obstacles) test::require_line(obstacle);
    }
  });
  return 0;
}
