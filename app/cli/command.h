// The commands of the program: each command declares its options and runs in a file of its own; main() lists them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/cli/options.h"

namespace knuckle::cli {

struct Command {
  std::string name, about;
  /// Declares the options, into storage that lives as long as what it returns: checks them, runs, gives the exit code.
  std::function<std::function<int()>(const OptionList& options)> declare;
};

/// A command whose options are members of a struct.
template <typename Options>
Command command(std::string name, std::string about, void (*add_options)(const OptionList&, Options&),
                std::function<int(const Options&)> run) {
  return {std::move(name), std::move(about), [add_options, run = std::move(run)](const OptionList& list) {
            const auto options = std::make_shared<Options>();
            add_options(list, *options);
            return [options, run] { return run(*options); };
          }};
}

/// Why no output may go to a place of this name: "is named like a computer's private key"; nullptr: it may.
using KeptName = const char* (*)(const std::filesystem::path& place);

struct Program {
  std::string name;            ///< As it is called, and as its messages begin.
  std::string about, example;  ///< For its help.
  std::vector<Command> commands;
  std::vector<KeptName> kept{};  ///< Of its parts that have files which no output may replace.
};

/// Gives the program's commands and options to `app`. @return what each command runs, by its name.
[[nodiscard]] std::map<std::string, std::function<int()>> declare(const Program& program, CLI::App& app);

/// What main() is to do: run, or print text (help or version).
struct CommandLine {
  std::function<int()> run;
  std::string text;
};

/// @param arguments without the program's name.
/// @throws InputError, one line, for unknown commands and options and for invalid values. `run` throws it
/// for values out of bounds, combinations that contradict each other, files that cannot be read.
[[nodiscard]] CommandLine parse_command_line(const Program& program, const std::vector<std::string>& arguments);

/// Reads the command line, runs the command, turns errors into exit codes, one line each. @return the exit code.
[[nodiscard]] int run_program(const Program& program, const std::vector<std::string>& arguments);

/// "knuckle 0.1.0"
[[nodiscard]] std::string program_version();
/// Date and time of the computer's clock: "2026-11-21T05:00:00Z".
[[nodiscard]] std::string now_utc();

// For the checks of a command's own options.
inline constexpr const char* kExitCodes =
    "Exit codes: 0 done (also after Ctrl+C of a program that runs until then); 1 failed or a criterion was not met; "
    "2 wrong usage or bad input; 130 ended by Ctrl+C before it was done.";

/// @param value may be empty: "option: why". @throws InputError "option value: why".
[[noreturn]] void refuse_option(const std::string& option, const std::string& value, const std::string& why);
/// A value that is not given is in every range. @throws InputError
void check_range(const char* option, const std::optional<double>& value, double low, double high, const char* unit);
/// Decimal or 0x...; nullopt where the text is no such number, or one above `most`.
[[nodiscard]] std::optional<std::uint32_t> whole_number(std::string_view text, std::uint32_t most);
/// Of a CANopen device. @throws InputError where the text is none.
[[nodiscard]] std::uint8_t node_id(const std::string& option, const std::string& text);
/// @throws InputError unless the file can be read.
void check_readable(const std::string& option, const std::string& file);
/// @throws InputError unless files can be made in the folder; where it is missing, in the one it would be made in.
void check_folder(const std::string& option, const std::string& folder);

/// No two outputs into one place, none over an input, any configuration file, what the program that was started keeps,
/// or a private key, an audit trail or a recording of any name, or a maker's DBC or EDS file. Empty names are ignored.
class Places {
 public:
  void input(const std::string& option, const std::string& file) { take(option, file, Use::kInput); }
  /// Configuration may be named, or be a file of the user's.
  void configuration(const std::string& option, const std::string& name_or_file);
  /// Data: CSV, JSON, pages, logs, recordings. @throws InputError where the place is taken, or is a .toml file: that is
  /// configuration, perhaps one that another option only names.
  void output(const std::string& option, const std::string& file);
  /// A machine or device file. @throws InputError where the place is taken, or does not end in .toml: other outputs
  /// would not keep off it.
  void configuration_output(const std::string& option, const std::string& file);

 private:
  enum class Use : std::uint8_t { kInput, kOutput };
  void take(const std::string& option, const std::string& file, Use use);
  std::map<std::string, std::string> taken_;  // path -> option
};

}  // namespace knuckle::cli
