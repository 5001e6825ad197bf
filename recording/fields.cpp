#include "recording/fields.h"

namespace knuckle::recording {

void SchemaText::field(std::string_view type, std::size_t count, std::string_view name) {
  own_.append(type);
  if (count > 0) own_.append("[").append(std::to_string(count)).append("]");
  own_.append(" ").append(name).append("\n");
}

void SchemaText::inner(std::string_view type, std::string_view definition) {
  if (!seen_.emplace(type).second) return;
  inner_.append(80, '=').append("\nMSG: ").append(type).append("\n").append(definition);
}

}  // namespace knuckle::recording
