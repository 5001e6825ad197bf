// A machine file whose six pressures are one transmitter's channels, on a bus of 250 kbit/s: the shipped one in other
// words.
#pragma once

#include <string>

#include "tests/support/keyed_nodes.h"
#include "tests/support/shipped.h"

namespace knuckle::test {

inline std::string few_nodes_text() {
  std::string text = shipped_text();
  const auto set = [&text](const std::string& key, const std::string& value) {
    const std::size_t at = text.find("\n" + key + " = ", text.find("\n[bus]"));
    const std::size_t from = at + key.size() + 4;
    text.replace(from, text.find_first_of(" \n", from) - from, value);
  };
  set("bit_rate_kbps", "250");
  set("sync_Hz", "100");
  set("valve_status_every_nth_sync", "2");
  set("tilt_every_nth_sync", "1");
  set("sensor_age_limit_ms", "45");
  std::string nodes = "[bus.wire]\npressure_value = \"integer16\"\npressure_digits = 1\n";
  const auto node = [&nodes](const char* name, const char* profile, const char* id, const char* identity,
                             const char* channels) {
    nodes += std::string("[[bus.node]]\nname = \"") + name + "\"\nprofile = \"" + profile + "\"\nid = " + id + "\n" +
             identity + "channels = { " + channels + " }\n";
  };
  const char* const valve = "device_type = 0x0198\nvendor = 0x4B4E\nproduct = 0x0408\n";
  const char* const encoder = "device_type = 0x0196\nvendor = 0x4B4E\nproduct = 0x0406\n";
  // In an order of its own.
  node("pressures", "cia404", "0x20", "device_type = 0x0194\nvendor = 0x4B4E\nproduct = 0x0404\n",
       "1 = \"bucket_head_pressure\", 2 = \"bucket_rod_pressure\", 3 = \"boom_head_pressure\", "
       "4 = \"boom_rod_pressure\", 6 = \"arm_head_pressure\", 7 = \"arm_rod_pressure\"");
  node("enable", "cia401", "0x40", "device_type = 0x0191\nvendor = 0x4B4E\nproduct = 0x0401\n",
       "1 = \"machine_enable\"");
  node("boom_valve", "cia408", "0x10", valve, "1 = \"boom_spool\"");
  node("arm_valve", "cia408", "0x11", valve, "1 = \"arm_spool\"");
  node("bucket_valve", "cia408", "0x12", valve, "1 = \"bucket_spool\"");
  node("boom_encoder", "cia406", "0x30", encoder, "1 = \"boom_length\"");
  node("arm_encoder", "cia406", "0x31", encoder, "1 = \"arm_length\"");
  node("bucket_encoder", "cia406", "0x32", encoder, "1 = \"bucket_length\"");
  node("tilt", "cia410", "0x38", "device_type = 0x019A\nvendor = 0x4B4E\nproduct = 0x0410\n", "1 = \"slope\"");
  return with_nodes(text, nodes);
}

}  // namespace knuckle::test
