// What stands at the beginning of every recording: which loops it has, what they were made of, and what its times mean.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/time.h"
#include "recording/mcap/contents.h"
#include "transport/link_header.h"
#include "transport/link_session.h"

namespace knuckle::recording {

inline constexpr const char* kHeadName = "knuckle";  ///< Of the metadata record that holds it.
// Attachments: the text of the files as they were read.
inline constexpr const char* kMachineFile = "machine.toml";
inline constexpr const char* kDeviceFile = "device.toml";
inline constexpr const char* kScenarioFile = "scenario.toml";
inline constexpr const char* kMappingFile = "mapping.toml";

struct Head {
  std::string program;               ///< "knuckle slave", with its arguments.
  std::string version;               ///< Of Knuckle.
  std::int64_t started_unix_ns = 0;  ///< Session time 0; 0 on virtual time, where it means nothing.
  bool virtual_time = false;
  bool simulated = false;  ///< The machine is a simulation.
  bool imported = false;   ///< Made of another program's table: it has no wires, and no loop of it ever ran.
  bool has_operator = false, has_machine = false;  ///< Whose loop is recorded.
  LinkStart operator_start, machine_start;         ///< Of the loops recorded.
  int link_version = kLinkVersion;                 ///< Of the datagrams recorded.
  std::string law = "echo";              ///< The operator's; in older recordings it may be one that is no more.
  bool far_end_is_this_machine = false;  ///< The operator's loop does not ask which machine it leads.
  /// Where the recording begins in the life of its loops: 1 is the first part. Flight records have 0: they begin in the
  /// middle.
  int part = 1;
  std::string machine_file, device_file, scenario_file;  ///< Text; empty: there is none.
  std::string mapping_file;                              ///< Likewise; that an imported table was read by.
};

[[nodiscard]] mcap::Metadata metadata_of(const Head& head);
[[nodiscard]] std::vector<mcap::Attachment> attachments_of(const Head& head);
/// What metadata_of() made. @throws InputError with `source` where a value is missing or none of Knuckle's.
[[nodiscard]] Head head_of(const mcap::Metadata& metadata, const std::string& source);

}  // namespace knuckle::recording
