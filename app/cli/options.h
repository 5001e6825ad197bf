// The options of a command: declared without the header of CLI11, which reads them and costs every file that includes
// it seconds of compiling.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace knuckle::cli {

/// Why a value is refused: "must be a whole number"; empty: it is not.
using ValueError = std::function<std::string(const std::string& value)>;

/// Of a seed. (CLI11 would take -1 for a very large one.)
[[nodiscard]] std::string seed_error(const std::string& value);
/// Of a whole number within [low, high].
[[nodiscard]] ValueError count_within(int low, int high);
/// Of how many machines an ensemble has: none, or two and more.
[[nodiscard]] std::string ensemble_size_error(const std::string& value);

/// An option that has been declared, for what else there is to say of it.
class DeclaredOption {
 public:
  explicit DeclaredOption(CLI::Option& option) noexcept : option_(&option) {}

  DeclaredOption required() const;
  /// Help and manual page say the value that holds where it is not given.
  DeclaredOption show_default() const;
  /// Of a list: takes one value, and is given again for the next.
  DeclaredOption one_value_each() const;
  /// What help calls its value: "NAME=SOURCE".
  DeclaredOption value_name(const std::string& name) const;
  DeclaredOption check(const ValueError& error) const;
  DeclaredOption one_of(const std::vector<std::string>& values) const;

 private:
  CLI::Option* option_;
};

/// Refers to a command's options; copies refer to the same. Valid until the command has run.
class OptionList {
 public:
  explicit OptionList(CLI::App& command) noexcept : command_(&command) {}

  /// @param name "--seed"; without dashes, what is given without a name. @param value std::string, double, int,
  /// std::uint32_t, std::uint64_t; one of these that is optional; a list of texts or of doubles. Outlives this.
  template <typename Value>
  DeclaredOption add_option(const std::string& name, Value& value, const std::string& about) const;
  /// @param value bool, or int: how often it was given.
  template <typename Value>
  DeclaredOption add_flag(const std::string& name, Value& value, const std::string& about) const;
  /// What its help says after the options, before the exit codes.
  void add_note(const std::string& text) const;

  // Once the command line has been read:
  [[nodiscard]] bool given(const std::string& name) const;
  /// " --scenario level --seed 7": all that was given, so that a shell reads it as it was.
  [[nodiscard]] std::string as_given() const;

 private:
  CLI::App* command_;
};

}  // namespace knuckle::cli
