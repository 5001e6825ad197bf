// Whether what a DBC file says of a message's bits has one meaning.
#pragma once

#include <cstdint>
#include <string>

#include "app/eds/dbc_file.h"

namespace knuckle::eds {

/// What is wrong, and in which line.
struct DbcFault {
  int line;
  std::string what;
};

/// The greatest raw value.
[[nodiscard]] constexpr std::uint64_t most_of(const BitField& field) noexcept {
  return ~std::uint64_t{0} >> (64U - field.bits);
}

/// In a condition whose multiplexer the signal's mark alone tells: the message's only one.
inline constexpr std::size_t kNotSaid = static_cast<std::size_t>(-1);

/// Of a multiplexed signal: which multiplexer, where its mark alone says it, and that it can have these values.
/// @throws DbcFault
void check_condition(const DbcMessage& message, DbcSignal& signal);

/// That no two signals share bits, but where a multiplexer tells them apart. @throws DbcFault
void check_bits(const DbcMessage& message);

}  // namespace knuckle::eds
