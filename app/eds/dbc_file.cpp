#include "app/eds/dbc_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/eds/dbc_checks.h"
#include "core/error.h"
#include "core/text.h"

namespace knuckle::eds {
namespace {

constexpr int kDeepest = 8;  // multiplexers inside one another

[[noreturn]] void refuse_signal(const DbcMessage& message, const DbcSignal& signal, const std::string& why) {
  throw DbcFault{signal.line, fmt::format("SG_ {} of {}: {}", signal.name, message.name, why)};
}

/// Multiplexers that it depends on.
int depth_of(const DbcMessage& message, const DbcSignal& signal) {
  int depth = 0;
  for (const DbcSignal* at = &signal; at->condition; at = &message.signals[at->condition->multiplexer])
    if (++depth > kDeepest)
      refuse_signal(message, signal, fmt::format("depends on itself, or on more than {} multiplexers", kDeepest));
  return depth;
}

/// Whether no frame has both signals: somewhere above them is one multiplexer with other values for each.
bool exclude(const DbcMessage& message, const std::vector<int>& depths, std::size_t a, std::size_t b) {
  const auto above = [&](std::size_t signal) { return message.signals[signal].condition->multiplexer; };
  while (depths[a] > depths[b]) a = above(a);
  while (depths[b] > depths[a]) b = above(b);
  while (a != b && depths[a] > 0 && above(a) != above(b)) {
    a = above(a);
    b = above(b);
  }
  if (a == b || depths[a] == 0) return false;
  const auto &of_a = message.signals[a].condition->values, &of_b = message.signals[b].condition->values;
  for (auto one = of_a.begin(), other = of_b.begin(); one != of_a.end() && other != of_b.end();) {
    if (one->first <= other->second && other->first <= one->second) return false;
    one->second < other->first ? static_cast<void>(++one) : static_cast<void>(++other);
  }
  return true;
}

/// In a message of several packets all that can be read are little endian.
bool share_bits(const DbcSignal& a, const DbcSignal& b) {
  if (!a.unusable.empty() || !b.unusable.empty()) return false;
  if (a.first_byte == b.first_byte) return overlap(a.field, b.field);
  const auto from = [](const DbcSignal& one) { return 8 * one.first_byte + one.field.start_bit; };
  return from(a) < from(b) + b.field.bits && from(b) < from(a) + a.field.bits;
}

}  // namespace

void check_condition(const DbcMessage& message, DbcSignal& signal) {
  DbcCondition& condition = *signal.condition;
  if (condition.multiplexer == kNotSaid) {
    const auto is_root = [](const DbcSignal& one) { return one.is_multiplexer && !one.condition; };
    if (std::count_if(message.signals.begin(), message.signals.end(), is_root) != 1)
      refuse_signal(message, signal,
                    "is multiplexed, and neither one multiplexer (M) nor SG_MUL_VAL_ says by which signal");
    const auto root = std::find_if(message.signals.begin(), message.signals.end(), is_root);
    condition.multiplexer = static_cast<std::size_t>(root - message.signals.begin());
  }
  const DbcSignal& multiplexer = message.signals[condition.multiplexer];
  if (!multiplexer.is_multiplexer || multiplexer.field.type == BitField::Type::kFloat)
    refuse_signal(message, signal, multiplexer.name + " is no multiplexer (M) of whole numbers");
  std::sort(condition.values.begin(), condition.values.end());
  if (const std::uint64_t most = most_of(multiplexer.field); condition.values.back().second > most)
    refuse_signal(message, signal, fmt::format("a value of multiplexer {} must be at most {}", multiplexer.name, most));
  const auto touches = [](const auto& one, const auto& next) { return next.first <= one.second; };
  const auto twice = std::adjacent_find(condition.values.begin(), condition.values.end(), touches);
  if (twice != condition.values.end())
    refuse_signal(message, signal,
                  fmt::format("value {} of multiplexer {} is in two ranges", twice[1].first, multiplexer.name));
}

void check_bits(const DbcMessage& message) {
  std::vector<int> depths;
  for (const DbcSignal& signal : message.signals) depths.push_back(depth_of(message, signal));
  for (std::size_t a = 0; a < message.signals.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const DbcSignal &signal = message.signals[a], &other = message.signals[b];
      if (share_bits(signal, other) && !exclude(message, depths, a, b))
        refuse_signal(
            message, signal,
            fmt::format("shares bits with {} of line {}, and no multiplexer tells them apart", other.name, other.line));
    }
  }
}

const DbcSignal* DbcMessage::find(std::string_view signal) const noexcept {
  const auto at =
      std::find_if(signals.begin(), signals.end(), [&](const DbcSignal& one) { return one.name == signal; });
  return at == signals.end() ? nullptr : &*at;
}

const DbcMessage& DbcFile::usable(std::string_view message) const {
  const auto is_it = [&](const DbcMessage& one) { return one.name == message; };
  const auto at = std::find_if(messages.begin(), messages.end(), is_it);
  if (at == messages.end()) throw InputError(fmt::format("{}: has no message '{}'", source, shortened(message)));
  if (!at->unusable.empty()) throw InputError(source + ": " + at->unusable);
  const auto other = std::find_if(at + 1, messages.end(), is_it);
  if (other == messages.end()) return *at;
  throw InputError(
      fmt::format("{}: line {}: BO_ {}: there is one in line {}, too", source, other->line, message, at->line));
}

void DbcFile::refuse(int line, const std::string& why) const {
  throw InputError(fmt::format("{}:{}: {}", source, line, why));
}

bool is_in(const CanFrame& frame, const DbcMessage& message, const DbcSignal& signal) noexcept {
  if (message.is_of_packets() || !read_raw(signal.field, frame)) return false;
  const DbcSignal* at = &signal;
  while (at->condition) {
    const auto& values = at->condition->values;
    at = &message.signals[at->condition->multiplexer];
    const auto value = read_raw(at->field, frame);
    const auto has = [&](const auto& range) { return range.first <= *value && *value <= range.second; };
    if (!value || std::none_of(values.begin(), values.end(), has)) return false;
  }
  return true;
}

}  // namespace knuckle::eds
