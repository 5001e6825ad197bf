#include "core/fields.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace knuckle {
namespace {

constexpr std::array<std::pair<std::string_view, const char*>, 14> kUnits{{{"rad", "rad"},
                                                                           {"radps", "rad/s"},
                                                                           {"m", "m"},
                                                                           {"N", "N"},
                                                                           {"N2", "N^2"},
                                                                           {"Nm", "N m"},
                                                                           {"N2m", "N^2 m"},
                                                                           {"J", "J"},
                                                                           {"kg", "kg"},
                                                                           {"Pa", "Pa"},
                                                                           {"s", "s"},
                                                                           {"ns", "ns"},
                                                                           {"degC", "degC"},
                                                                           {"V", "V"}}};

template <typename Number>
double read(const std::byte* at) noexcept {
  Number number{};
  std::memcpy(&number, at, sizeof number);
  return static_cast<double>(number);
}

}  // namespace

std::string unit_of(std::string_view name) {
  const std::size_t at = name.rfind('_');
  const std::string_view end = at == std::string_view::npos ? name : name.substr(at + 1);
  const auto* const unit = std::find_if(kUnits.begin(), kUnits.end(), [end](const auto& u) { return u.first == end; });
  return unit == kUnits.end() ? "" : unit->second;
}

double number_at(const void* start, const Field& field, std::size_t element) noexcept {
  const std::byte* const at = static_cast<const std::byte*>(start) + field.offset;
  switch (field.type) {
    case NumberType::kUint8:
      return read<std::uint8_t>(at);
    case NumberType::kUint16:
      return read<std::uint16_t>(at);
    case NumberType::kUint32:
      return read<std::uint32_t>(at);
    case NumberType::kUint64:
      return read<std::uint64_t>(at);
    case NumberType::kInt64:
      return read<std::int64_t>(at);
    case NumberType::kFloat:
      return read<float>(at);
    case NumberType::kDouble:
      return read<double>(at + element * sizeof(double));
  }
  return 0;
}

}  // namespace knuckle
