#include "app/cli/json.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace knuckle::cli {

/// Into the library's value.
struct JsonWriter {
  nlohmann::ordered_json operator()(const Json& json) const {
    return std::visit([this](const auto& value) { return (*this)(value); }, json.value_);
  }
  nlohmann::ordered_json operator()(const Json::Array& values) const {
    nlohmann::ordered_json array = nlohmann::ordered_json::array();
    for (const Json& value : values) array.push_back((*this)(value));
    return array;
  }
  nlohmann::ordered_json operator()(const Json::Object& object) const {
    nlohmann::ordered_json members = nlohmann::ordered_json::object();
    for (std::size_t i = 0; i < object.keys.size(); ++i) members[object.keys[i]] = (*this)(object.values[i]);
    return members;
  }
  template <typename Plain>
  nlohmann::ordered_json operator()(const Plain& value) const {
    return value;
  }
};

Json::Json(std::nullptr_t) noexcept {}
Json::Json(bool value) noexcept : value_(value) {}
Json::Json(double value) noexcept : value_(value) {}
Json::Json(std::int64_t value) noexcept : value_(value) {}
Json::Json(std::uint64_t value) noexcept : value_(value) {}
Json::Json(std::string text) noexcept : value_(std::move(text)) {}
Json::Json(std::string_view text) : value_(std::string(text)) {}
Json::Json(const char* text) : value_(std::string(text)) {}
Json::Json(Array values) noexcept : value_(std::move(values)) {}

Json::Json(const Json& other) = default;
Json::Json(Json&& other) noexcept = default;
Json& Json::operator=(const Json& other) = default;
Json& Json::operator=(Json&& other) noexcept = default;
Json::~Json() = default;

Json Json::array() {
  return Json(Array());
}

Json Json::object() {
  Json json;
  json.value_ = Object();
  return json;
}

Json::Json(std::initializer_list<Json> values) {
  const auto is_member = [](const Json& value) {
    const auto* pair = std::get_if<Array>(&value.value_);
    return pair != nullptr && pair->size() == 2 && std::holds_alternative<std::string>((*pair)[0].value_);
  };
  if (!std::all_of(values.begin(), values.end(), is_member)) {
    value_ = Array(values);
    return;
  }
  value_ = Object();
  for (const Json& value : values) {
    const Array& pair = std::get<Array>(value.value_);
    (*this)[std::get<std::string>(pair[0].value_)] = pair[1];
  }
}

Json& Json::operator[](std::string_view key) {
  if (std::holds_alternative<std::nullptr_t>(value_)) value_ = Object();
  auto& [keys, values] = std::get<Object>(value_);
  const auto found = std::find(keys.begin(), keys.end(), key);
  if (found != keys.end()) return values[static_cast<std::size_t>(found - keys.begin())];
  keys.emplace_back(key);
  return values.emplace_back();
}

void Json::push_back(Json value) {
  if (std::holds_alternative<std::nullptr_t>(value_)) value_ = Array();
  std::get<Array>(value_).push_back(std::move(value));
}

void Json::update(Json other) {
  if (std::holds_alternative<std::nullptr_t>(other.value_)) return;
  auto& [keys, values] = std::get<Object>(other.value_);
  for (std::size_t i = 0; i < keys.size(); ++i) (*this)[keys[i]] = std::move(values[i]);
}

std::string Json::dump(int indent) const {
  return JsonWriter()(*this).dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string Json::dump_ascii() const {
  return JsonWriter()(*this).dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace knuckle::cli
