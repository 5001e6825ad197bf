#include "recording/fields.h"

#include <algorithm>
#include <cctype>

namespace knuckle::recording {

std::string schema_name(std::string_view field) {
  std::string lower(field);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

void SchemaText::line(std::string_view type, std::string_view name) {
  own_.append(type).append(" ").append(name).append("\n");
}

void SchemaText::field(std::string_view type, std::size_t count, std::string_view name) {
  line(count > 0 ? std::string(type) + "[" + std::to_string(count) + "]" : std::string(type), schema_name(name));
}

void SchemaText::inner(std::string_view type, std::string_view definition) {
  if (!seen_.emplace(type).second) return;
  inner_.append(80, '=').append("\nMSG: ").append(type).append("\n").append(definition);
}

}  // namespace knuckle::recording
