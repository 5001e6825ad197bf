#include "app/eds/dbc_to_machine.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "core/error.h"
#include "machine/bus_description.h"
#include "machine/reason_text.h"
#include "machine/toml_reader.h"
#include "transport/j1939.h"

namespace knuckle::eds {

const DbcSignal& signal_of(const DbcFile& dbc, const DbcMessage& message, const std::string& name) {
  const DbcSignal* const signal = message.find(name);
  if (signal == nullptr) {
    std::vector<std::string> names;
    for (const DbcSignal& has : message.signals) names.push_back(has.name);
    throw InputError(fmt::format("{}:{}: {} has no signal {}; it has {}", dbc.source, message.line, message.name, name,
                                 fmt::join(names, ", ")));
  }
  if (signal->condition)
    throw InputError(fmt::format("{}:{}: signal {} of {} is multiplexed: must be in every frame of the message",
                                 dbc.source, signal->line, signal->name, message.name));
  return *signal;
}

std::string head_text(const DbcFile& dbc, const DbcMessage& message, const char* header, bool may_be_group) {
  if (!message.period_s)
    throw InputError(
        fmt::format("{}:{}: {} has no cycle time (GenMsgCycleTime): a machine file must say how often it comes",
                    dbc.source, message.line, message.name));
  const bool extended = (message.id & kExtendedId) != 0;
  const std::uint32_t id = message.id & ~kExtendedId;
  std::string text = fmt::format("{}\nname = \"{}\"\n", header, message.name);
  if (may_be_group && message.j1939) {
    text += fmt::format("pgn = 0x{:04X}\n", j1939::group_of(id));
  } else {
    text += fmt::format("id = {}\n", id_text(message.id));
    if (extended && id <= kMostId) text += "extended = true\n";
  }
  return text + fmt::format("bytes = {}\nperiod_ms = {}\n", message.size, number_text(1e3 * *message.period_s));
}

std::string bits_text(const BitField& field) {
  std::string text = fmt::format("start = {}, bits = {}", field.start_bit, field.bits);
  if (field.order == BitField::Order::kBigEndian) text += ", order = \"big\"";
  if (field.type == BitField::Type::kSigned) text += ", type = \"signed\"";
  if (field.type == BitField::Type::kFloat) text += ", type = \"float\"";
  return text;
}

std::string scale_text(const BitField& field) {
  std::string text = fmt::format(", scale = {}", field.scale);
  if (field.offset != 0) text += fmt::format(", offset = {}", field.offset);
  return text;
}

}  // namespace knuckle::eds
