#include "app/export/dbc.h"

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/export/bus_messages.h"
#include "machine/bus_description.h"
#include "machine/description.h"

namespace knuckle::exporting {
namespace {

/// In quotes; DBC has no way to write one inside.
std::string quoted(std::string text) {
  std::replace(text.begin(), text.end(), '"', '\'');
  std::replace(text.begin(), text.end(), '\\', '/');
  return '"' + text + '"';
}

std::string listed(const std::vector<std::string>& names) {
  return names.empty() ? "Vector__XXX" : fmt::format("{}", fmt::join(names, ","));
}

void write_message(std::ostream& out, const Message& message) {
  fmt::print(out, "BO_ {} {}: {} {}\n", message.id, message.name, message.size, message.sender);
  for (const Signal& signal : message.signals) {
    fmt::print(out, " SG_ {} : {}|{}@1{} ({},0) [{}|{}] {} {}\n", signal.name, signal.start_bit, signal.bits,
               signal.type == Signal::Type::kUnsigned ? '+' : '-', signal.factor, signal.min, signal.max,
               quoted(signal.unit), listed(message.receivers));
  }
  out << '\n';
}

std::string about(const Message& message) {
  const std::string rate = message.period_s ? fmt::format("every {:.6g} ms in operation", *message.period_s * 1e3) : "";
  return message.about + (message.about.empty() || rate.empty() ? "" : "; ") + rate;
}

std::string about(const NamedNode& named) {
  const NodeDescription& node = named.node;
  return fmt::format("CANopen node 0x{:02X}: device type 0x{:X}, vendor 0x{:X}, product 0x{:X}", node.id,
                     node.device_type, node.vendor, node.product);
}

void write_comments(std::ostream& out, const MachineDescription& machine, const std::vector<NamedNode>& nodes,
                    const std::vector<Message>& messages) {
  fmt::print(out, "CM_ {};\n",
             quoted(fmt::format("CANopen bus of {}. Written by {} from {}.", machine.name, cli::program_version(),
                                std::filesystem::path(machine.source).filename().string())));
  fmt::print(out, "CM_ BU_ {} {};\n", kController,
             quoted(fmt::format("Knuckle, CANopen node 0x{:02X}", machine.bus.controller_id)));
  for (const NamedNode& node : nodes) fmt::print(out, "CM_ BU_ {} {};\n", node.name, quoted(about(node)));
  for (const Message& message : messages) {
    if (const std::string text = about(message); !text.empty())
      fmt::print(out, "CM_ BO_ {} {};\n", message.id, quoted(text));
    for (const Signal& signal : message.signals) {
      if (!signal.about.empty()) fmt::print(out, "CM_ SG_ {} {} {};\n", message.id, signal.name, quoted(signal.about));
    }
  }
}

void write_attributes(std::ostream& out, const MachineDescription& machine, const std::vector<Message>& messages) {
  constexpr int kLongest_ms = 60000;
  fmt::print(out,
             "BA_DEF_ \"BusType\" STRING ;\nBA_DEF_ \"Baudrate\" INT 0 1000000;\n"
             "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 {};\nBA_DEF_DEF_ \"BusType\" \"CAN\";\n"
             "BA_DEF_DEF_ \"Baudrate\" 500000;\nBA_DEF_DEF_ \"GenMsgCycleTime\" 0;\nBA_ \"Baudrate\" {};\n",
             kLongest_ms, machine.bus.bit_rate);
  for (const Message& message : messages) {
    if (!message.period_s) continue;
    const double period_ms = *message.period_s * 1e3, whole_ms = std::round(period_ms);
    if (whole_ms >= 1 && whole_ms <= kLongest_ms && std::abs(period_ms - whole_ms) < 1e-9 * period_ms)
      fmt::print(out, "BA_ \"GenMsgCycleTime\" BO_ {} {};\n", message.id, whole_ms);
  }
}

void write_values(std::ostream& out, const std::vector<Message>& messages) {
  for (const Message& message : messages) {
    for (const Signal& signal : message.signals) {
      if (signal.values.empty()) continue;
      fmt::print(out, "VAL_ {} {}", message.id, signal.name);
      for (const auto& [raw, name] : signal.values) fmt::print(out, " {} {}", raw, quoted(name));
      out << " ;\n";
    }
  }
  for (const Message& message : messages) {
    for (const Signal& signal : message.signals) {
      if (signal.type == Signal::Type::kFloat) fmt::print(out, "SIG_VALTYPE_ {} {} : 1;\n", message.id, signal.name);
    }
  }
}

}  // namespace

void write_dbc(const MachineDescription& read, std::ostream& out) {
  const MachineDescription machine = calibrated(read);
  const std::vector<NamedNode> nodes = named_nodes(machine.bus);
  const std::vector<Message> messages = bus_messages(machine);
  out << "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: " << kController;
  for (const NamedNode& node : nodes) out << ' ' << node.name;
  out << "\n\n";
  for (const Message& message : messages) write_message(out, message);
  write_comments(out, machine, nodes, messages);
  write_attributes(out, machine, messages);
  write_values(out, messages);
}

}  // namespace knuckle::exporting
