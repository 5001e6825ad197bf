// Plain structs (core/fields.h) as recorded messages: their schema (ROS 2's) and their bytes (CDR).
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/fields.h"
#include "core/reason.h"
#include "recording/cdr.h"

namespace knuckle::recording {

/// Appends a value to a message. Allocates nothing.
template <typename T>
void put(CdrWriter& out, const T& value) noexcept {
  if constexpr (ScalarField<T>) {
    out.put(number_of(value));
  } else if constexpr (VectorField<T>) {
    for (const double element : std::span(value.data(), static_cast<std::size_t>(value.size()))) out.put(element);
  } else {
    visit_fields(value, [&out](const char*, const auto& member) { put(out, member); });
  }
}
template <typename T>
void get(CdrReader& in, T& value) noexcept {
  if constexpr (ScalarField<T>) {
    const auto number = in.get<decltype(number_of(value))>();
    if constexpr (std::is_enum_v<T>)
      if (number >= number_of_words(T{})) in.refuse();
    value = scalar_of<T>(number);
  } else if constexpr (VectorField<T>) {
    for (double& element : std::span(value.data(), static_cast<std::size_t>(value.size()))) in.get(element);
  } else {
    visit_fields(value, [&in](const char*, auto& member) { get(in, member); });
  }
}

/// A message in today's form (recording/states.h) as a struct. @return whether it is one: it has the length, and its
/// modes and codes are known.
template <typename T>
[[nodiscard]] bool decode(std::span<const std::uint8_t> message, T& value) noexcept {
  CdrReader in(message);
  get(in, value);
  return in.ok() && in.at() == message.size();
}

/// Calls take(name, number) for every number in a value; those of vectors and nested structs have names such as
/// "joint_rad[0]" and "fault.code".
template <typename T, typename Take>
void for_each_number(const std::string& name, const T& value, const Take& take) {
  if constexpr (ScalarField<T>) {
    take(name, number_of(value));
  } else if constexpr (VectorField<T>) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(value.size()); ++i)
      take(name + "[" + std::to_string(i) + "]", value.data()[i]);
  } else {
    visit_fields(value, [&](const char* member, const auto& inner) {
      for_each_number(name.empty() ? member : name + "." + member, inner, take);
    });
  }
}

namespace detail {

template <typename Number>
[[nodiscard]] constexpr const char* ros_type() noexcept {
  if constexpr (std::is_same_v<Number, double>) return "float64";
  if constexpr (std::is_same_v<Number, float>) return "float32";
  if constexpr (std::is_same_v<Number, std::int64_t>) return "int64";
  if constexpr (std::is_same_v<Number, std::uint64_t>) return "uint64";
  if constexpr (std::is_same_v<Number, std::uint32_t>) return "uint32";
  if constexpr (std::is_same_v<Number, std::int32_t>) return "int32";
  if constexpr (std::is_same_v<Number, std::uint16_t>) return "uint16";
  if constexpr (std::is_same_v<Number, std::uint8_t>) return "uint8";
}

template <typename T>
[[nodiscard]] constexpr const char* struct_name() noexcept {
  if constexpr (std::is_same_v<T, Reason>) {
    return "knuckle_msgs/Reason";
  } else {
    return T::kSchemaName;
  }
}

}  // namespace detail

/// As a field is called in a schema: in lower case, unit or not, as ROS 2 allows no other.
[[nodiscard]] std::string schema_name(std::string_view field);

/// Lines of a ROS 2 definition.
class SchemaText {
 public:
  /// As it is.
  void line(std::string_view type, std::string_view name);
  /// @param count of a fixed array; 0: no array.
  void field(std::string_view type, std::size_t count, std::string_view name);
  /// A message within, defined behind all that uses it; once, however often it is.
  void inner(std::string_view type, std::string_view definition);
  [[nodiscard]] std::string text() const { return own_ + inner_; }

 private:
  std::string own_, inner_;
  std::set<std::string> seen_;
};

/// ROS 2's definition of a struct's message: its fields, and behind them those of the structs within.
template <typename T>
[[nodiscard]] std::string schema_text() {
  SchemaText schema;
  const T example{};
  visit_fields(example, [&](const char* name, const auto& member) {
    using Member = std::remove_cvref_t<decltype(member)>;
    if constexpr (ScalarField<Member>) {
      schema.field(std::is_same_v<Member, bool> ? "bool" : detail::ros_type<decltype(number_of(member))>(), 0, name);
    } else if constexpr (VectorField<Member>) {
      schema.field("float64", static_cast<std::size_t>(member.size()), name);
    } else {
      schema.field(detail::struct_name<Member>(), 0, name);
      schema.inner(detail::struct_name<Member>(), schema_text<Member>());
    }
  });
  return schema.text();
}

}  // namespace knuckle::recording
