// `knuckle bus migrate`: the nodes of a machine file from [bus.nodes], a key for each, to [[bus.node]] tables.
#pragma once

#include <string>

namespace knuckle::eds {

/// The machine file's text with [[bus.node]] tables in place of [bus.nodes]; comments, order, numbers as they are
/// written and everything else stay. A text without [bus.nodes] is returned as it is.
/// @throws InputError where it is no machine file, where a node is neither on one line in [bus.nodes] nor a table
/// [bus.nodes.NAME], or where the result would not be the same bus.
[[nodiscard]] std::string with_node_tables(const std::string& machine_text, const std::string& machine_source);

}  // namespace knuckle::eds
