// `knuckle bus import`: frames from and to the machine's own controller, described by its DBC, become
// [[bus.broadcast]] and [[bus.command]] tables of a machine file, which is whole by itself from then on.
#pragma once

#include <string>
#include <vector>

#include "app/eds/dbc_file.h"
#include "app/eds/dbc_wanted.h"

namespace knuckle::eds {

struct Import {
  std::string text;                      ///< Of the machine file.
  std::vector<std::string> frames;       ///< "Front_Angle (0x18FF1021): boom_angle, arm_angle"
  std::vector<std::string> gone_nodes;   ///< Whose signals these frames have now.
  std::vector<std::string> gone_frames;  ///< Whose last signal or joint was moved.
  std::vector<std::string> at_rest;      ///< "boom in Rates": fields of joints that other frames command from now on.
  std::vector<std::string> to_do;        ///< What a DBC does not say.
};
/// The machine file's text with these signals and commands in place of the nodes that had them; all else as it was. A
/// frame that the file has already gets what it has not, and of the rest what the DBC says anew: its comments, period,
/// sign, zero, neutral and all else that a DBC does not say stay. A signal that another frame had is moved, with them.
/// An older file has its nodes in tables then (with_node_tables()).
/// @throws InputError, one line, where the DBC has no such signal, or one without a fixed place, period or unit, where
/// a node would lose but some of its channels, or where the result is no machine file.
[[nodiscard]] Import with_frames(const std::string& machine_text, const std::string& machine_source, const DbcFile& dbc,
                                 const Wanted& wanted);

}  // namespace knuckle::eds
