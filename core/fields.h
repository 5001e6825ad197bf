// Plain structs as data. Such a struct lists its members once, in a static function
//
//   template <typename Self, typename Visit>
//   static void fields(Self& self, Visit&& visit) {
//     [[maybe_unused]] const auto& [joint_rad, fault] = self;  // all members: with one more it does not compile
//     visit("joint_rad", self.joint_rad);  // not the name above, which goes by its place alone
//     visit("fault", self.fault);
//   }
//
// and from that list come its recorded message, its columns in tables and data files, and its digest. A name ends in
// the unit of its value. What may be a member: numbers, bool, enums, Time, fixed vectors of doubles, Reason, and
// structs like these.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/reason.h"
#include "core/time.h"

namespace knuckle {

/// Members of a struct that does not list them itself.
template <typename Self, typename Visit>
requires std::is_same_v<std::remove_const_t<Self>, Reason>
void visit_fields(Self& self, Visit&& visit) {
  visit("code", self.code);
  visit("subject", self.subject);
  visit("value", self.value);
  visit("limit", self.limit);
}
template <typename Self, typename Visit>
requires requires(Self& self, Visit& visit) {
  std::remove_const_t<Self>::fields(self, visit);
}
void visit_fields(Self& self, Visit&& visit) {
  std::remove_const_t<Self>::fields(self, visit);
}

template <typename T>
concept ScalarField = std::is_arithmetic_v<T> || std::is_enum_v<T> || std::is_same_v<T, Time>;
template <typename T>
concept VectorField = requires(const T& v) {
  { *v.data() } -> std::convertible_to<double>;
  v.size();
};

/// A scalar as a number: bool as a byte, an enum as its number, a time in nanoseconds.
template <ScalarField T>
[[nodiscard]] auto number_of(T value) noexcept {
  if constexpr (std::is_same_v<T, bool>) {
    return static_cast<std::uint8_t>(value);
  } else if constexpr (std::is_enum_v<T>) {
    return static_cast<std::underlying_type_t<T>>(value);
  } else if constexpr (std::is_same_v<T, Time>) {
    return static_cast<std::int64_t>(value.time_since_epoch().count());
  } else {
    return value;
  }
}
template <ScalarField T, typename Number>
[[nodiscard]] T scalar_of(Number number) noexcept {
  if constexpr (std::is_same_v<T, Time>) {
    return Time(Duration(number));
  } else {
    return static_cast<T>(number);
  }
}

/// How a number is stored.
enum class NumberType : std::uint8_t { kUint8, kUint16, kUint32, kUint64, kInt64, kFloat, kDouble };
template <typename Number>
[[nodiscard]] constexpr NumberType type_of() noexcept {
  if constexpr (std::is_same_v<Number, std::uint8_t>) return NumberType::kUint8;
  if constexpr (std::is_same_v<Number, std::uint16_t>) return NumberType::kUint16;
  if constexpr (std::is_same_v<Number, std::uint32_t>) return NumberType::kUint32;
  if constexpr (std::is_same_v<Number, std::uint64_t>) return NumberType::kUint64;
  if constexpr (std::is_same_v<Number, std::int64_t>) return NumberType::kInt64;
  if constexpr (std::is_same_v<Number, float>) return NumberType::kFloat;
  if constexpr (std::is_same_v<Number, double>) return NumberType::kDouble;
}

/// Where a number, a word or a vector of doubles stands in a struct, and what it is called. A reason is four of them:
/// its code as a word, and with "_subject", "_value" and "_limit" behind its name the rest.
struct Field {
  std::string name;  ///< Ends in the unit: "joint_rad".
  std::string part;  ///< Name of the struct within that it is a member of, such as "truth"; empty: of none.
  NumberType type{};
  std::size_t offset = 0, size = 0;         ///< In bytes.
  std::size_t count = 1;                    ///< Of numbers.
  bool vector = false;                      ///< Of doubles.
  bool time = false;                        ///< In nanoseconds.
  bool of_device = false;                   ///< A vector of the device's joints; else of the machine's, or of axes.
  const char* (*word)(unsigned) = nullptr;  ///< Of an enum's number; null: it is none.
  unsigned words = 0;                       ///< How many there are.
};

/// "rad/s", "N m" for a name's end; empty: the name has none.
[[nodiscard]] std::string unit_of(std::string_view name);

/// @param start of the struct. @param element of a vector.
[[nodiscard]] double number_at(const void* start, const Field& field, std::size_t element = 0) noexcept;

[[nodiscard]] constexpr unsigned number_of_words(ReasonCode) noexcept {
  return static_cast<unsigned>(ReasonCode::kCount);
}

namespace detail {

template <typename T>
[[nodiscard]] Field field_at(const void* start, const T& value) {
  Field field;
  field.offset =
      static_cast<std::size_t>(reinterpret_cast<const std::byte*>(&value) - static_cast<const std::byte*>(start));
  field.size = sizeof value;
  if constexpr (VectorField<T>) {
    field.type = NumberType::kDouble;
    field.count = static_cast<std::size_t>(value.size());
    field.vector = true;
  } else {
    field.type = type_of<decltype(number_of(value))>();
    field.time = std::is_same_v<T, Time>;
  }
  if constexpr (std::is_enum_v<T>) {
    field.word = [](unsigned number) { return name(static_cast<T>(number)); };
    field.words = number_of_words(T{});
  }
  return field;
}

template <typename T>
void add_fields(std::vector<Field>& all, const void* start, const T& value, const std::string& part) {
  visit_fields(value, [&](const char* name, const auto& member) {
    using Member = std::remove_cvref_t<decltype(member)>;
    const auto add = [&](const auto& inner, const std::string& called) {
      Field field = field_at(start, inner);
      field.name = called;
      field.part = part;
      if constexpr (requires { T::of_device(called); }) field.of_device = T::of_device(called);
      all.push_back(std::move(field));
    };
    if constexpr (std::is_same_v<Member, Reason>) {
      visit_fields(member, [&](const char* of_reason, const auto& inner) {
        add(inner, std::string_view(of_reason) == "code" ? std::string(name) : std::string(name) + "_" + of_reason);
      });
    } else if constexpr (ScalarField<Member> || VectorField<Member>) {
      add(member, name);
    } else {
      add_fields(all, start, member, name);
    }
  });
}

}  // namespace detail

/// All of a struct, in their order, those of structs within where these stand.
template <typename T>
[[nodiscard]] const std::vector<Field>& fields_of() {
  static const std::vector<Field> fields = [] {
    const T example{};
    std::vector<Field> all;
    detail::add_fields(all, &example, example, "");
    return all;
  }();
  return fields;
}

}  // namespace knuckle
