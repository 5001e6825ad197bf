// What is written as JSON, put together without the header of the library that writes it (nlohmann's), which costs
// every file that includes it seconds of compiling. Files that read JSON use that library itself.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace knuckle::cli {

/// One value. Braces make objects of pairs of a key and a value, {{"seed", 7}, {"passed", true}}, and arrays of
/// anything else, as nlohmann's do. Objects keep the order in which they were filled.
class Json {
 public:
  Json(std::nullptr_t = nullptr) noexcept;
  Json(bool value) noexcept;
  Json(double value) noexcept;  ///< One that is not finite is written as null.
  Json(std::int64_t value) noexcept;
  Json(std::uint64_t value) noexcept;
  template <std::integral Whole>
  Json(Whole value) noexcept : Json(std::conditional_t<std::is_signed_v<Whole>, std::int64_t, std::uint64_t>{value}) {}
  Json(std::string text) noexcept;
  Json(std::string_view text);
  Json(const char* text);
  /// nullopt: null.
  template <typename Value>
  Json(const std::optional<Value>& value) {
    if (value) *this = Json(*value);
  }
  template <typename Value>
  Json(const std::vector<Value>& list) : Json(Array(list.begin(), list.end())) {}
  template <typename Value, std::size_t kSize>
  Json(const std::array<Value, kSize>& list) : Json(Array(list.begin(), list.end())) {}
  Json(std::initializer_list<Json> values);
  [[nodiscard]] static Json array();
  [[nodiscard]] static Json object();

  Json(const Json& other);
  Json(Json&& other) noexcept;
  Json& operator=(const Json& other);
  Json& operator=(Json&& other) noexcept;
  ~Json();

  /// Of an object, or of null, which becomes one. A key that is not there yet is added, with null.
  Json& operator[](std::string_view key);
  /// To an array, or to null, which becomes one.
  void push_back(Json value);
  /// Adds what another object has, in place of what has the same key; null has nothing.
  void update(Json other);

  /// @param indent spaces of each level; negative: all in one line. What is not UTF-8 is written as U+FFFD.
  [[nodiscard]] std::string dump(int indent = -1) const;
  /// In one line, with \u... for all that is not ASCII.
  [[nodiscard]] std::string dump_ascii() const;

 private:
  using Array = std::vector<Json>;
  struct Object {
    std::vector<std::string> keys;
    Array values;  ///< Of the keys, in their order.
  };
  explicit Json(Array values) noexcept;
  friend struct JsonWriter;

  std::variant<std::nullptr_t, bool, std::int64_t, std::uint64_t, double, std::string, Array, Object> value_;
};

}  // namespace knuckle::cli
