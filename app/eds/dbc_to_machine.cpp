#include "app/eds/dbc_to_machine.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <vector>

#include "machine/bus_description.h"
#include "machine/reason_text.h"
#include "machine/toml_reader.h"
#include "transport/j1939.h"

namespace knuckle::eds {
namespace {

constexpr std::size_t kMostFrames = 256;  // that a multiplexer tells apart

}  // namespace

const DbcSignal& signal_of(const DbcFile& dbc, const DbcMessage& message, const std::string& name) {
  const DbcSignal* const signal = message.find(name);
  if (signal == nullptr) {
    std::vector<std::string> names;
    for (const DbcSignal& has : message.signals) names.push_back(has.name);
    dbc.refuse(message.line, fmt::format("{} has no signal {}; it has {}", message.name, name, fmt::join(names, ", ")));
  }
  if (!signal->unusable.empty())
    dbc.refuse(signal->line, fmt::format("signal {} of {} {}", name, message.name, signal->unusable));
  return *signal;
}

std::optional<DbcMultiplexing> multiplexing_of(const DbcFile& dbc, const DbcMessage& message, const DbcSignal& signal) {
  if (!signal.condition) return std::nullopt;
  const DbcSignal& multiplexer = message.signals[signal.condition->multiplexer];
  const auto refuse = [&](const std::string& why) {
    dbc.refuse(signal.line, fmt::format("signal {} of {} {}", signal.name, message.name, why));
  };
  if (multiplexer.condition)
    refuse(fmt::format("is multiplexed by {}, which is multiplexed itself: a machine file has one multiplexer a frame",
                       multiplexer.name));
  const auto [from, to] = signal.condition->values.front();
  if (signal.condition->values.size() > 1 || from != to)
    refuse(fmt::format("comes with several values of {}: a machine file takes it with one alone", multiplexer.name));
  std::set<std::uint64_t> values;
  for (const DbcSignal& other : message.signals) {
    if (!other.condition || other.condition->multiplexer != signal.condition->multiplexer) continue;
    for (const auto& [first, last] : other.condition->values)
      for (std::uint64_t value = first; value <= last && values.size() < kMostFrames; ++value) values.insert(value);
  }
  return DbcMultiplexing{&multiplexer, from, values.size()};
}

std::string frame_name(const DbcMessage& message, const std::optional<DbcMultiplexing>& by) {
  return by ? fmt::format("{}_{}", message.name, by->value) : message.name;
}

std::string id_lines(const DbcMessage& message, bool may_be_group) {
  const std::uint32_t id = message.id & ~kExtendedId;
  if (may_be_group && message.j1939) return fmt::format("pgn = 0x{:04X}\n", j1939::group_of(id));
  const bool looks_short = message.id != id && id <= kMostId;
  return fmt::format("id = {}\n{}", id_text(message.id), looks_short ? "extended = true\n" : "");
}

std::string head_text(const DbcFile& dbc, const DbcMessage& message, const char* header, const std::string& ids,
                      const std::optional<DbcMultiplexing>& by) {
  if (!message.period_s)
    dbc.refuse(message.line,
               fmt::format("{} has no cycle time (GenMsgCycleTime): say how often it comes by --period {}=MILLISECONDS",
                           message.name, message.name));
  const double period_s = *message.period_s * (by ? static_cast<double>(by->of) : 1);
  std::string text = fmt::format("{}\nname = \"{}\"\n{}bytes = {}\nperiod_ms = {}\n", header, frame_name(message, by),
                                 ids, message.size, number_text(1e3 * period_s));
  if (by) text += fmt::format("multiplexer = {{ {}, value = {} }}\n", bits_text(by->multiplexer->field), by->value);
  return text;
}

DbcFile with_periods(DbcFile dbc, const std::vector<WantedPeriod>& periods) {
  for (const auto& [message, period_ms] : periods) {
    const DbcMessage& said = dbc.usable(message);
    dbc.messages[static_cast<std::size_t>(&said - dbc.messages.data())].period_s = 1e-3 * period_ms;
  }
  return dbc;
}

std::string bits_text(const BitField& field, unsigned first_byte) {
  constexpr unsigned kByte = 8;
  std::string text = fmt::format("start = {}, bits = {}", kByte * first_byte + field.start_bit, field.bits);
  if (field.order == BitField::Order::kBigEndian) text += ", order = \"big\"";
  if (field.type == BitField::Type::kSigned) text += ", type = \"signed\"";
  if (field.type == BitField::Type::kFloat) text += ", type = \"float\"";
  return text;
}

bool is_place(const std::string& key) {
  return key == "start" || key == "bits" || key == "order" || key == "type";
}

std::string scale_text(const BitField& field) {
  std::string text = fmt::format(", scale = {}", field.scale);
  if (field.offset != 0) text += fmt::format(", offset = {}", field.offset);
  return text;
}

}  // namespace knuckle::eds
