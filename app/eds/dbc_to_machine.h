// What of a DBC stands in machine files, in their words.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/eds/dbc_file.h"
#include "app/eds/dbc_wanted.h"

namespace knuckle::eds {

/// @throws InputError where the message has no such signal, or one that nobody can read.
[[nodiscard]] const DbcSignal& signal_of(const DbcFile& dbc, const DbcMessage& message, const std::string& name);

/// Of a signal that is there only where a multiplexer has this value: one of so many that tell the message's frames
/// apart.
struct DbcMultiplexing {
  const DbcSignal* multiplexer = nullptr;
  std::uint64_t value = 0;
  std::size_t of = 1;
};
/// Nothing where it is in every frame. @throws InputError where its multiplexer is multiplexed itself, or has several
/// values.
[[nodiscard]] std::optional<DbcMultiplexing> multiplexing_of(const DbcFile& dbc, const DbcMessage& message,
                                                             const DbcSignal& signal);

/// As the machine file calls it: the message's, and the multiplexer's value.
[[nodiscard]] std::string frame_name(const DbcMessage& message, const std::optional<DbcMultiplexing>& by);

/// Lines with the message's identifier; of J1939 its parameter group, where that may stand in place of it.
[[nodiscard]] std::string id_lines(const DbcMessage& message, bool may_be_group);

/// A table's header, with name, identifier, bytes, period and multiplexer. A DBC has the message's period: frames that
/// are told apart are taken to come in turn. @throws InputError where the message has no period.
[[nodiscard]] std::string head_text(const DbcFile& dbc, const DbcMessage& message, const char* header,
                                    const std::string& ids, const std::optional<DbcMultiplexing>& by = {});

/// With these in place of the DBC's. @throws InputError where it has no such message.
[[nodiscard]] DbcFile with_periods(DbcFile dbc, const std::vector<WantedPeriod>& periods);

/// "start = 0, bits = 16, order = "big"": where the number is and what kind it is.
[[nodiscard]] std::string bits_text(const BitField& field, unsigned first_byte = 0);

/// Whether bits_text() has this key.
[[nodiscard]] bool is_place(const std::string& key);

/// ", scale = 0.01, offset = -10"
[[nodiscard]] std::string scale_text(const BitField& field);

}  // namespace knuckle::eds
