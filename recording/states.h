// States of other versions of Knuckle in today's form, by the names in the recording's own schema.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "recording/cdr.h"
#include "recording/fields.h"

namespace knuckle::recording {

/// From messages of one schema to messages of another. A field that they lack keeps its initial value, one that has
/// gone is passed over, one that is called otherwise today or has more bits is found.
class StateTranslation {
 public:
  /// @param recorded, today schemas. @param initial message of today's schema. @param where file and topic.
  /// @throws InputError naming `where` and the field where one has another type today, or is of no fixed size.
  StateTranslation(const std::string& recorded, const std::string& today, std::vector<std::uint8_t> initial,
                   const std::string& where);

  /// @return until the next one; empty where it is no message of the recorded schema.
  [[nodiscard]] std::span<const std::uint8_t> translated(std::span<const std::uint8_t> message) noexcept;
  /// Schema names of what the recorded messages do not have: "payload_kg", "fault.limit".
  [[nodiscard]] const std::vector<std::string>& lacks() const noexcept { return lacks_; }

 private:
  struct Copy {
    std::size_t from = 0, to = 0, bytes = 0;
  };
  std::vector<Copy> copies_;
  std::size_t recorded_bytes_ = 0;
  std::vector<std::uint8_t> message_;
  std::vector<std::string> lacks_;
};

/// Nothing where the recorded messages have today's form. @throws InputError as above.
template <typename State>
[[nodiscard]] std::optional<StateTranslation> translation_to(const std::string& recorded, const std::string& where) {
  constexpr std::size_t kMostBytes = 4096;
  const std::string today = schema_text<State>();
  if (recorded == today) return std::nullopt;
  std::vector<std::uint8_t> initial(kMostBytes);
  CdrWriter out(initial);
  put(out, State{});
  initial.resize(out.size());
  return StateTranslation(recorded, today, std::move(initial), where);
}

}  // namespace knuckle::recording
