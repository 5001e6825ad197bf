// The default machine with its three valves as the axes of one node.
#pragma once

#include <string>

#include "tests/support/shipped.h"

namespace knuckle::test {

inline constexpr const char* kThreeAxes = "{ 1 = \"boom_spool\", 2 = \"arm_spool\", 3 = \"bucket_spool\" }";

/// @param channels of the node; @param keys more of them, in lines.
inline std::string axes_text(const std::string& channels = kThreeAxes, const std::string& keys = "") {
  std::string text = shipped_text();
  const std::size_t begin = text.find("[[bus.node]]\nname = \"boom_valve\"");
  const std::size_t end = text.find("[[bus.node]]\nname = \"boom_head_pressure\"");
  const std::string node =
      "[[bus.node]]\nname = \"valves\"\nprofile = \"cia408\"\nid = 0x10\ndevice_type = 0x0FFF0198\n"
      "vendor = 0x4B4E\nproduct = 0x0408\nchannels = " +
      channels + "\n" + keys + "\n";
  return text.replace(begin, end - begin, node);
}

}  // namespace knuckle::test
