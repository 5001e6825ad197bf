#include "app/cli/command.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <sstream>

#include "app/cli/background_writer.h"
#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "app/cli/terminal.h"
#include "core/error.h"
#include "core/nearest_name.h"
#include "core/text.h"

namespace knuckle::cli {
namespace {

constexpr const char* kOtherName = ": choose another name";

std::vector<KeptName> kept_names;  // of the program that was started

std::string shown(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

/// Names and files of the command line go into tables, pages, JSON and machine files, which know text only.
void check_printable(const std::vector<std::string>& arguments) {
  for (const std::string& argument : arguments) {
    if (printable(argument) != argument)
      throw InputError("argument '" + shortened(argument) + "': must be UTF-8 without control characters");
  }
}

/// An unset variable of a shell must not mean "as if not given".
void check_given(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_expected_min() == 0) continue;
    for (const std::string& value : option->results()) {
      if (value.empty()) refuse_option(option->get_name(), "\"\"", "must not be empty");
    }
  }
}

/// Of the first of these arguments that is an option, none of the command's; empty where none of them is.
std::string unknown_option(const std::vector<std::string>& arguments, const CLI::App& command) {
  const auto bare = [](const std::string& word) {
    const auto begin = std::min(word.find_first_not_of('-'), word.size());
    return word.substr(begin, word.find('=') - begin);
  };
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back(name);
  }
  for (const std::string& word : arguments) {
    if (!word.starts_with('-') || bare(word).empty()) continue;
    const auto meant = nearest_name(bare(word), names);
    return shortened(word) + ": unknown option" + (meant ? "; did you mean '--" + *meant + "'?" : "");
  }
  return "";
}

/// Of the first of these arguments that is an option with a value too many or none; empty where none is.
std::string misplaced_value(const std::vector<std::string>& arguments, const CLI::App& command) {
  const auto option_of = [&command](const std::string& word) {
    return command.get_option_no_throw(word.substr(0, word.find('=')));
  };
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const CLI::Option* const option = arguments[i].starts_with('-') ? option_of(arguments[i]) : nullptr;
    if (option == nullptr) continue;
    const bool flag = option->get_expected_max() == 0, given_here = arguments[i].find('=') != std::string::npos;
    if (flag && given_here) return option->get_name() + ": takes no value";
    const bool without = given_here ? arguments[i].ends_with('=') : i + 1 == arguments.size();
    if (!flag && without) return option->get_name() + ": needs a value";
    const auto again = std::find_if(arguments.begin() + static_cast<std::ptrdiff_t>(i) + 1, arguments.end(),
                                    [&](const std::string& word) { return option_of(word) == option; });
    if (again != arguments.end() && option->get_expected_max() <= 1)
      return option->get_name() + ": is given more than once";
  }
  return "";
}

/// CLI11 would take the next option for the value. One that begins so is given as --json=--name. @throws InputError
void check_no_value_left_out(const std::vector<std::string>& arguments, const CLI::App& command) {
  for (std::size_t i = 0; i + 1 < arguments.size() && arguments[i] != "--"; ++i) {
    const std::string &word = arguments[i], &next = arguments[i + 1];
    const CLI::Option* const option = word.starts_with('-') ? command.get_option_no_throw(word) : nullptr;
    const bool needs_value = option != nullptr && option->get_expected_max() > 0;
    const bool another = next.starts_with('-') && command.get_option_no_throw(next) != nullptr;  // such as -v
    if (needs_value && (another || next.starts_with("--"))) refuse_option(option->get_name(), "", "needs a value");
  }
}

/// Where CLI11 leaves it to be guessed which option is meant, in words of our own.
std::string refusal(const CLI::ParseError& error, const CLI::App& app, const std::string& command,
                    const std::vector<std::string>& arguments) {
  const CLI::App& options = command.empty() ? app : *app.get_subcommand(command);
  const auto code = static_cast<CLI::ExitCodes>(error.get_exit_code());
  std::string message;
  if (command.empty() || code == CLI::ExitCodes::ExtrasError)
    message = unknown_option(app.remaining(true), options);
  else if (code == CLI::ExitCodes::ArgumentMismatch)
    message = misplaced_value(arguments, options);
  if (!message.empty()) return message;
  message = error.what();
  return message.substr(0, message.find('\n'));
}

/// The requested command; empty where none is given. @throws InputError for an unknown one.
std::string command_in(const Program& program, const std::vector<std::string>& arguments) {
  if (arguments.front().starts_with('-')) return "";
  std::string names;
  for (const Command& command : program.commands) {
    if (command.name == arguments.front()) return command.name;
    names += (names.empty() ? "" : ", ") + command.name;
  }
  throw InputError("unknown command '" + shortened(arguments.front()) + "': the commands are " + names + " (see " +
                   program.name + " --help)");
}

}  // namespace

std::map<std::string, std::function<int()>> declare(const Program& program, CLI::App& app) {
  app.set_version_flag("--version", program_version());
  app.require_subcommand(1);
  app.footer(program.example + kExitCodes);
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::Throw);
  std::map<std::string, std::function<int()>> runs;
  for (const Command& command : program.commands) {
    CLI::App& options = *app.add_subcommand(command.name, command.about);
    options.footer(kExitCodes);
    runs[command.name] = command.declare(OptionList(options));
  }
  return runs;
}

CommandLine parse_command_line(const Program& program, const std::vector<std::string>& arguments) {
  check_printable(arguments);
  kept_names = program.kept;
  if (arguments.empty()) return parse_command_line(program, {"--help"});
  const std::string asked_for = command_in(program, arguments);
  const auto app = std::make_shared<CLI::App>(program.about, program.name);
  const std::map<std::string, std::function<int()>> runs = declare(program, *app);
  const std::string see_help = " (see " + program.name + " " + (asked_for.empty() ? "" : asked_for + " ") + "--help)";
  try {
    if (!asked_for.empty()) check_no_value_left_out(arguments, *app->get_subcommand(asked_for));
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());  // the order CLI11 takes a vector in
    app->parse(std::move(reversed));
  } catch (const CLI::Success& asked) {
    std::ostringstream text, unused;
    app->exit(asked, text, unused);
    return {{}, text.str()};
  } catch (const CLI::ParseError& error) {
    throw InputError(refusal(error, *app, asked_for, arguments) + see_help);
  } catch (const InputError& error) {  // also a value that an option refuses (options.cpp)
    throw InputError(error.what() + see_help);
  }
  const CLI::App& chosen = *app->get_subcommands().front();
  check_given(chosen);
  return {[app, run = runs.at(chosen.get_name())] { return run(); }, {}};  // a command may ask what it was given
}

namespace {

/// A file opened later must not become standard output or error. What is put in their place refuses every read and
/// write, as a closed descriptor does.
void take_closed_descriptors() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) != -1) continue;
    (void)!open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY);  // the lowest that is free: this one
  }
}

/// Not where standard output was closed at the start (take_closed_descriptors), nor after `knuckle --help | head -1`.
bool anybody_reads_output() {
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  const bool closed = (fcntl(STDOUT_FILENO, F_GETFL) & O_ACCMODE) == O_RDONLY;
  return !closed && (poll(&output, 1, 0) < 1 || (output.revents & POLLERR) == 0);
}

/// One name for each place; "-": standard output.
std::string place_of(const std::string& file) {
  if (is_standard_output(file)) return "-";
  std::error_code nameless;  // such as a pipe of another process
  const auto real = std::filesystem::weakly_canonical(std::filesystem::absolute(file), nameless);
  return nameless ? file : real.string();
}

/// What a file holds that no output may replace, whatever it is called; nullptr: nothing of the kind.
const char* kept_content(const std::string& file) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(file, none)) return nullptr;
  std::string start(4096, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(in.gcount()));
  const auto has = [&start](const char* text) { return start.find(text) != std::string::npos; };
  if (start.starts_with("-----BEGIN ") && has("PRIVATE KEY-----")) return "holds a private key";
  if (start.starts_with("{\"n\":") && has("\"mono_s\":") && has("\"before\":")) return "holds an audit trail";
  if (start.starts_with("\x89MCAP0\r\n")) return "holds a recording";
  std::string kind = std::filesystem::path(file).extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](unsigned char c) { return std::tolower(c); });
  if (kind == ".eds" && !start.empty()) return "is a vendor's device file";
  if (kind != ".dbc" || start.empty()) return nullptr;
  in.clear();
  start.append(std::istreambuf_iterator<char>(in), {});
  return has("Written by knuckle ") ? nullptr : "is a DBC that Knuckle did not write";  // export/write_dbc.cpp
}

}  // namespace

int run_program(const Program& program, const std::vector<std::string>& arguments) {
  take_closed_descriptors();
  const PrintableOutput printable_out(std::cout), printable_err(std::cerr);
  constexpr int kBadInput = 2, kFailed = 1, kInterrupted = 130;
  // Whatever a file or the command line put into it, a terminal gets one printable line; and a reader that stalls does
  // not keep the program from ending.
  const auto say = [&](const std::string& message) {
    BackgroundWriter(STDERR_FILENO).stream() << program.name << ": " << one_message(message) << '\n';
  };
  try {
    const CommandLine line = parse_command_line(program, arguments);
    const int code = line.run ? line.run() : 0;
    const InterruptGuard pipes_only_fail;
    const std::size_t width = terminal_width();
    std::cout << (width > 0 ? wrapped(line.text, width) : line.text);
    if (std::cout.flush() || !anybody_reads_output()) return code;
    say("standard output: cannot be written");
    return kBadInput;
  } catch (const InputError& error) {
    say(error.what());
    return kBadInput;
  } catch (const Interrupted& interrupted) {
    say(interrupted.what());
    return kInterrupted;
  } catch (const std::filesystem::filesystem_error& error) {  // such as links in a circle
    say(error.path1().string() + ": " + error.code().message());
    return kBadInput;
  } catch (const std::exception& error) {
    say(std::string("internal error: ") + error.what());
    return kFailed;
  }
}

std::string program_version() {
  return std::string("knuckle ") + KNUCKLE_VERSION;
}

std::string now_utc() {
  return utc_text(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now()));
}

void refuse_option(const std::string& option, const std::string& value, const std::string& why) {
  throw InputError(option + (value.empty() ? "" : " " + value) + ": " + why);
}

void check_range(const char* option, const std::optional<double>& value, double low, double high, const char* unit) {
  if (!value || (*value >= low && *value <= high)) return;  // a NaN is in no range
  refuse_option(option, shown(*value), "must be from " + shown(low) + " to " + shown(high) + unit);
}

std::optional<std::uint32_t> whole_number(std::string_view text, std::uint32_t most) {
  const bool hex = text.starts_with("0x");
  if (hex) text.remove_prefix(2);
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, hex ? 16 : 10);
  if (error != std::errc() || end != text.data() + text.size() || value > most) return std::nullopt;
  return value;
}

std::uint8_t node_id(const std::string& option, const std::string& text) {
  constexpr std::uint32_t kLast = 127;
  const auto id = whole_number(text, kLast);
  if (!id || *id == 0) refuse_option(option, text, "must be a node id, 1 to 127 or 0x01 to 0x7F");
  return static_cast<std::uint8_t>(*id);
}

void check_readable(const std::string& option, const std::string& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) refuse_option(option, file, error ? error.message() : "no such file");
  if (std::filesystem::is_directory(file, error)) refuse_option(option, file, "is a folder, not a file");
  if (!std::filesystem::is_regular_file(file, error)) refuse_option(option, file, "is not a regular file");
  if (!std::ifstream(file)) refuse_option(option, file, "cannot be read");
}

void check_folder(const std::string& option, const std::string& folder) {
  if (is_standard_output(folder)) refuse_option(option, folder, "is a folder, not standard output");
  std::filesystem::path there = std::filesystem::absolute(folder).lexically_normal();
  std::error_code error;
  while (!std::filesystem::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  const bool is_folder = std::filesystem::is_directory(there, error);
  if (is_folder && access(there.c_str(), W_OK | X_OK) == 0) return;
  refuse_option(option, folder, std::string("cannot be written: ") + std::strerror(is_folder ? errno : ENOTDIR));
}

void Places::configuration(const std::string& option, const std::string& name_or_file) {
  std::error_code none;  // its loader says why
  if (std::filesystem::exists(name_or_file, none)) take(option, name_or_file, Use::kInput);
}

void Places::output(const std::string& option, const std::string& file) {
  take(option, file, Use::kOutput);
  if (!file.empty() && std::filesystem::path(place_of(file)).extension() == ".toml")
    refuse_option(option, file, std::string("is named like a machine or other configuration file") + kOtherName);
}

void Places::configuration_output(const std::string& option, const std::string& file) {
  take(option, file, Use::kOutput);
  std::error_code none;
  const bool special = std::filesystem::exists(file, none) && !std::filesystem::is_regular_file(file, none);
  if (!file.empty() && !is_standard_output(file) && !special && !file.ends_with(".toml"))
    refuse_option(option, file, "must end in .toml, as all machine and device files do");
}

void Places::take(const std::string& option, const std::string& file, Use use) {
  if (file.empty()) return;
  const std::string path = place_of(file);
  const auto [other, is_new] = taken_.emplace(path, option);
  if (use == Use::kInput) return;
  if (!is_new) {
    const char* const stream = path == "-" ? ": only one output can be standard output" : "";
    refuse_option(option, file, "already taken by " + other->second + stream);
  }
  const char* why = kept_content(path);
  for (const KeptName kept : kept_names)
    if (why == nullptr) why = kept(path);
  if (why != nullptr) refuse_option(option, file, std::string(why) + kOtherName);
}

}  // namespace knuckle::cli
