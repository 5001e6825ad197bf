// What of a DBC stands in machine files, in their words.
#pragma once

#include <string>

#include "app/eds/dbc_file.h"

namespace knuckle::eds {

/// @throws InputError where the message has no such signal, or not in every frame.
[[nodiscard]] const DbcSignal& signal_of(const DbcFile& dbc, const DbcMessage& message, const std::string& name);

/// A table's header, with name, id, bytes and period. @throws InputError where the message has no period.
/// @param may_be_group of J1939 its parameter group in place of the id.
[[nodiscard]] std::string head_text(const DbcFile& dbc, const DbcMessage& message, const char* header,
                                    bool may_be_group = false);

/// "start = 0, bits = 16, order = "big"": where the number is and what kind it is.
[[nodiscard]] std::string bits_text(const BitField& field);

/// ", scale = 0.01, offset = -10"
[[nodiscard]] std::string scale_text(const BitField& field);

}  // namespace knuckle::eds
