#include "recording/states.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <map>
#include <sstream>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/text.h"

namespace knuckle::recording {
namespace {

// A schema comes out of a file: what is beyond these is none of a state.
constexpr std::size_t kMostBytes = 1 << 16, kMostFields = 4096;
constexpr int kDeepest = 4;

/// Names that fields had in earlier versions, and have today.
constexpr std::array<std::pair<std::string_view, std::string_view>, 2> kRenamed{
    {{"shown_n", "rendered_n"}, {"yielding", "contact_compliance"}}};

/// 0: it is no number's.
std::size_t bytes_of(std::string_view type) noexcept {
  constexpr std::array<std::pair<std::string_view, std::size_t>, 11> kTypes{{{"bool", 1},
                                                                             {"uint8", 1},
                                                                             {"int8", 1},
                                                                             {"uint16", 2},
                                                                             {"int16", 2},
                                                                             {"uint32", 4},
                                                                             {"int32", 4},
                                                                             {"float32", 4},
                                                                             {"uint64", 8},
                                                                             {"int64", 8},
                                                                             {"float64", 8}}};
  const auto* const known =
      std::find_if(kTypes.begin(), kTypes.end(), [type](const auto& t) { return t.first == type; });
  return known == kTypes.end() ? 0 : known->second;
}

/// Where the numbers of a message with this schema are, behind the message's header.
class Layout {
 public:
  struct Place {
    std::string name, type;  ///< "fault.limit", "float64[3]"
    std::size_t at = 0, bytes = 0;
  };

  Layout(const std::string& schema, const std::string& where) : where_(where) {
    std::string message;
    std::istringstream lines(schema);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream parts(line.substr(0, line.find('#')));
      std::string first, second;
      if (!(parts >> first >> second) || second.find('=') != std::string::npos) continue;
      if (first == "MSG:")
        message = second;
      else
        messages_[message].emplace_back(first, second);
    }
    add("", "", 0);
  }

  [[nodiscard]] const std::vector<Place>& places() const noexcept { return places_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

 private:
  void add(const std::string& message, const std::string& path, int depth) {
    for (const auto& [type, name] : messages_[message]) {
      const std::size_t bracket = std::min(type.find('['), type.size());
      const std::string element = type.substr(0, bracket);
      const std::size_t size = bytes_of(element);
      const bool within = size == 0 && bracket == type.size() && messages_.contains(element) && depth < kDeepest;
      const std::size_t count = bracket == type.size() ? 1 : count_in(std::string_view(type).substr(bracket));
      if ((size == 0 && !within) || count == 0 || ++fields_ > kMostFields)
        throw InputError(
            fmt::format("{}: schema: {} {}: is no field of a state", where_, shortened(type), shortened(path + name)));
      if (within) {
        add(element, path + name + ".", depth + 1);
      } else {
        const std::size_t at = (bytes_ + size - 1) / size * size;
        places_.push_back({path + name, type, at, size * count});
        bytes_ = at + size * count;
      }
    }
  }

  /// Of "[3]"; 0: it is no such count, or too large.
  [[nodiscard]] static std::size_t count_in(std::string_view brackets) noexcept {
    if (brackets.size() < 3) return 0;
    std::size_t count = 0;
    const char* const end = brackets.data() + brackets.size() - 1;
    const auto [behind, error] = std::from_chars(brackets.data() + 1, end, count);
    return error == std::errc() && behind == end && *end == ']' && count <= kMostBytes ? count : 0;
  }

  std::string where_;
  std::map<std::string, std::vector<std::pair<std::string, std::string>>> messages_;  ///< The schema's own has no name.
  std::vector<Place> places_;
  std::size_t bytes_ = 0, fields_ = 0;
};

std::string_view name_today(std::string_view name) noexcept {
  for (const auto& [before, today] : kRenamed)
    if (name == before) return today;
  return name;
}

}  // namespace

StateTranslation::StateTranslation(const std::string& recorded, const std::string& today,
                                   std::vector<std::uint8_t> initial, const std::string& where)
    : message_(std::move(initial)) {
  const Layout from(recorded, where), to(today, where);
  std::map<std::string_view, const Layout::Place*> by_name;
  for (const Layout::Place& place : from.places()) by_name.emplace(name_today(place.name), &place);
  for (const Layout::Place& place : to.places()) {
    const auto found = by_name.find(place.name);
    if (found == by_name.end()) {
      lacks_.push_back(place.name);
      continue;
    }
    const Layout::Place& other = *found->second;
    // Bits that have become more: the lowest bytes are the same, those above are zero.
    const bool wider = other.type == "uint8" && place.type == "uint16";
    if (other.type != place.type && !wider)
      throw InputError(fmt::format("{}: {} is recorded as {}, and is {} in this version of Knuckle: cannot be read",
                                   where, other.name, shortened(other.type), place.type));
    copies_.push_back({kCdrHeader.size() + other.at, kCdrHeader.size() + place.at, other.bytes});
  }
  recorded_bytes_ = kCdrHeader.size() + from.bytes();
}

std::span<const std::uint8_t> StateTranslation::translated(std::span<const std::uint8_t> message) noexcept {
  if (message.size() != recorded_bytes_ || !std::equal(kCdrHeader.begin(), kCdrHeader.begin() + 2, message.begin()))
    return {};
  for (const Copy& copy : copies_) std::memcpy(&message_[copy.to], &message[copy.from], copy.bytes);
  return message_;
}

}  // namespace knuckle::recording
