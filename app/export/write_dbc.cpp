// The machine's bus as DBC.
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/cli/command.h"
#include "app/export/export_command.h"
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
    const std::string mark = signal.is_multiplexer     ? " M"
                             : signal.with_multiplexer ? fmt::format(" m{}", *signal.with_multiplexer)
                                                       : "";
    fmt::print(out, " SG_ {}{} : {}|{}@{}{} ({},{}) [{}|{}] {} {}\n", signal.name, mark, signal.start_bit, signal.bits,
               signal.order == BitField::Order::kLittleEndian ? 1 : 0,
               signal.type == BitField::Type::kUnsigned ? '+' : '-', signal.factor, signal.offset, signal.min,
               signal.max, quoted(signal.unit), listed(message.receivers));
  }
  out << '\n';
}

std::string about(const Message& message) {
  const std::string rate = message.period_s ? fmt::format("every {:.6g} ms in operation", *message.period_s * 1e3) : "";
  return message.about + (message.about.empty() || rate.empty() ? "" : "; ") + rate;
}

std::string about(const NodeDescription& node) {
  return fmt::format("CANopen node 0x{:02X}: device type 0x{:X}, vendor 0x{:X}, product 0x{:X}", node.id,
                     node.device_type, node.vendor, node.product);
}

void write_comments(std::ostream& out, const MachineDescription& machine, const std::vector<Message>& messages) {
  fmt::print(out, "CM_ {};\n",
             quoted(fmt::format("{} of {}. Written by {} from {}.",
                                machine.bus.name.empty() ? "CANopen bus" : "Bus " + machine.bus.name, machine.name,
                                cli::program_version(), std::filesystem::path(machine.source).filename().string())));
  fmt::print(out, "CM_ BU_ {} {};\n", kController,
             quoted(fmt::format("Knuckle, CANopen node 0x{:02X}", machine.bus.controller_id)));
  for (const NodeDescription& node : machine.bus.nodes)
    fmt::print(out, "CM_ BU_ {} {};\n", node.name, quoted(about(node)));
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
  // That a message is a J1939 parameter group.
  constexpr const char* kFormats =
      "BA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\",\"ExtendedCAN\",\"reserved\",\"J1939PG\";\n";
  constexpr const char* kFormat = "BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";\n";
  const std::vector<BroadcastFrame>& own = machine.bus.broadcasts;
  const bool groups = std::any_of(own.begin(), own.end(), [](const BroadcastFrame& frame) { return frame.is_group(); });
  fmt::print(out,
             "BA_DEF_ \"BusType\" STRING ;\nBA_DEF_ \"Baudrate\" INT 0 1000000;\n"
             "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 {};\n{}BA_DEF_DEF_ \"BusType\" \"CAN\";\n"
             "BA_DEF_DEF_ \"Baudrate\" 500000;\nBA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n{}BA_ \"Baudrate\" {};\n",
             kLongest_ms, groups ? kFormats : "", groups ? kFormat : "", machine.bus.bit_rate);
  for (const Message& message : messages)
    if (std::any_of(own.begin(), own.end(),
                    [&](const BroadcastFrame& frame) { return frame.is_group() && frame.id == message.id; }))
      fmt::print(out, "BA_ \"VFrameFormat\" BO_ {} 3;\n", message.id);
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
      if (signal.type == BitField::Type::kFloat)
        fmt::print(out, "SIG_VALTYPE_ {} {} : {};\n", message.id, signal.name, signal.bits == 64 ? 2 : 1);
    }
  }
}

bool speaks_itself(const BusDescription& bus) {
  const auto own = [](const auto& frame) { return frame.module == 0; };
  return std::any_of(bus.broadcasts.begin(), bus.broadcasts.end(), own) ||
         std::any_of(bus.commands.begin(), bus.commands.end(), own);
}

}  // namespace

void write_dbc(const MachineDescription& read, std::ostream& out) {
  const MachineDescription machine = calibrated(read);
  const std::vector<Message> messages = bus_messages(machine);
  out << "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: " << kController;
  for (const NodeDescription& node : machine.bus.nodes) out << ' ' << node.name;
  if (speaks_itself(machine.bus)) out << ' ' << kMachine;
  out << "\n\n";
  for (const Message& message : messages) write_message(out, message);
  write_comments(out, machine, messages);
  write_attributes(out, machine, messages);
  write_values(out, messages);
}

}  // namespace knuckle::exporting
