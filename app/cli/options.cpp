#include "app/cli/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include "app/cli/command.h"

namespace knuckle::cli {
namespace {

/// As a shell reads it as one word.
std::string quoted(const std::string& word) {
  const bool plain = std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c >= 0x80 || std::strchr("_-./:,=+@%", c) != nullptr;
  });
  if (plain && !word.empty()) return word;
  std::string safe;
  for (const char c : word) safe += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return "'" + safe + "'";
}

template <typename Number>
bool is_number(const std::string& text, Number& number) {
  const auto end = std::from_chars(text.data(), text.data() + text.size(), number);
  return end.ec == std::errc() && end.ptr == text.data() + text.size();
}

/// Of a number of this type.
template <typename Number>
std::string number_error(const std::string& text) {
  Number number{};
  if (is_number(text, number)) return "";
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  if (read.ec == std::errc::result_out_of_range && read.ptr == text.data() + text.size() &&
      std::is_floating_point_v<Number>)
    return "is larger or smaller than any number of this computer";
  std::string with_point = text;
  std::replace(with_point.begin(), with_point.end(), ',', '.');
  const bool comma = with_point != text && is_number(with_point, number);
  if (std::is_unsigned_v<Number>)
    return "must be a whole number from 0 to " + std::to_string(std::numeric_limits<Number>::max());
  return std::string(std::is_integral_v<Number> ? "is not a whole number" : "is not a number") +
         (comma ? ": decimals need a point, not a comma" : "");
}

template <typename Value>
struct NumberOf {
  using type = Value;
};
template <typename Value>
struct NumberOf<std::optional<Value>> : NumberOf<Value> {};
template <typename Value>
struct NumberOf<std::vector<Value>> : NumberOf<Value> {};

/// Refuses in words of our own: whatever a check of CLI11 returns comes out in a sentence of CLI11. Goes before the
/// checks that there are: that of a type's numbers, which is the first, is then asked last.
void add_check(CLI::Option& option, const ValueError& error, const std::string& shown_in_help = "") {
  const auto refuse = [&option, error](const std::string& value) {
    const std::string why = error(value);
    if (!why.empty()) refuse_option(option.get_name(), value.empty() ? "\"\"" : value, why);
    return std::string();
  };
  option.transform(CLI::Validator(refuse, shown_in_help));
}

}  // namespace

std::string seed_error(const std::string& value) {
  return number_error<std::uint64_t>(value);
}

ValueError count_within(int low, int high) {
  return [low, high](const std::string& value) -> std::string {
    int count = 0;
    if (is_number(value, count) && count >= low && count <= high) return "";
    return "must be a whole number from " + std::to_string(low) + " to " + std::to_string(high);
  };
}

std::string ensemble_size_error(const std::string& value) {
  const std::string error = count_within(2, 10'000)(value);
  return value == "0" || error.empty() ? "" : error + " machines, or 0: none";
}

DeclaredOption DeclaredOption::required() const {
  option_->required();
  return *this;
}

DeclaredOption DeclaredOption::show_default() const {
  option_->capture_default_str();
  return *this;
}

DeclaredOption DeclaredOption::one_value_each() const {
  option_->allow_extra_args(false);
  return *this;
}

DeclaredOption DeclaredOption::value_name(const std::string& name) const {
  option_->type_name(name);
  return *this;
}

DeclaredOption DeclaredOption::check(const ValueError& error) const {
  add_check(*option_, error);
  return *this;
}

DeclaredOption DeclaredOption::one_of(const std::vector<std::string>& values) const {
  std::string names;
  for (const std::string& value : values) names += (names.empty() ? "" : ",") + value;
  const auto error = [values, names](const std::string& value) {
    return std::find(values.begin(), values.end(), value) == values.end() ? "not in {" + names + "}" : "";
  };
  add_check(*option_, error, "{" + names + "}");
  return *this;
}

template <typename Value>
DeclaredOption OptionList::add_option(const std::string& name, Value& value, const std::string& about) const {
  CLI::Option& option = *command_->add_option(name, value, about);
  using Number = typename NumberOf<Value>::type;
  if constexpr (std::is_arithmetic_v<Number>) add_check(option, number_error<Number>);
  return DeclaredOption(option);
}

template <typename Value>
DeclaredOption OptionList::add_flag(const std::string& name, Value& value, const std::string& about) const {
  return DeclaredOption(*command_->add_flag(name, value, about)->disable_flag_override());
}

template DeclaredOption OptionList::add_option(const std::string&, std::string&, const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, double&, const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, int&, const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, std::uint32_t&, const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, std::uint64_t&, const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, std::optional<std::string>&,
                                               const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, std::optional<double>&, const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, std::optional<int>&, const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, std::optional<std::uint32_t>&,
                                               const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, std::optional<std::uint64_t>&,
                                               const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, std::vector<std::string>&, const std::string&) const;
template DeclaredOption OptionList::add_option(const std::string&, std::vector<double>&, const std::string&) const;
template DeclaredOption OptionList::add_flag(const std::string&, bool&, const std::string&) const;
template DeclaredOption OptionList::add_flag(const std::string&, int&, const std::string&) const;

void OptionList::add_note(const std::string& text) const {
  command_->footer(text + '\n' + kExitCodes);
}

bool OptionList::given(const std::string& name) const {
  return command_->count(name) > 0;
}

std::string OptionList::as_given() const {
  std::string line;
  for (const CLI::Option* option : std::as_const(*command_).get_options()) {
    const bool flag = option->get_expected_max() == 0;
    for (const std::string& value : option->results()) {
      const bool named = !option->get_positional();
      if (named) line += " " + option->get_name();
      if (!flag) line += (named && value.starts_with("--") ? "=" : " ") + quoted(value);
    }
  }
  return line;
}

}  // namespace knuckle::cli
