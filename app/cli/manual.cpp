#include "app/cli/manual.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace knuckle::cli {
namespace {

/// Text as it is, whatever roff would make of it.
std::string roff(const std::string& text) {
  std::string safe;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool begins_line = i == 0 || text[i - 1] == '\n';
    if (begins_line && (text[i] == '.' || text[i] == '\'')) safe += "\\&";
    if (text[i] == '\\') {
      safe += "\\e";
    } else if (text[i] == '-') {
      safe += "\\-";
    } else {
      safe += text[i];
    }
  }
  return safe;
}

/// What the value is, as man pages show it; CLI11 names C++ types.
std::string value_name(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  if (type.starts_with("FLOAT")) return "number";
  if (type.starts_with("UINT") || type.starts_with("INT")) return "count";
  return "value";
}

bool takes_value(const CLI::Option& option) {
  return option.get_expected_max() > 0 && option.get_type_size_max() > 0;
}

/// "--log", "-h"
std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<const CLI::Option*> shown_options(const CLI::App& command) {
  std::vector<const CLI::Option*> options;
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_group().empty()) options.push_back(option);
  }
  return options;
}

void add_option(std::string& page, const CLI::Option& option) {
  page += ".TP\n";
  if (option.get_positional()) {
    page += "\\fI" + roff(option.get_name()) + "\\fP";
  } else {
    std::string names;
    for (const std::string& name : names_of(option))
      names += (names.empty() ? "" : ", ") + ("\\fB" + roff(name)) + "\\fP";
    page += names + (takes_value(option) ? " \\fI" + value_name(option) + "\\fP" : "");
  }
  const std::string preset = option.get_default_str();
  page += "\n" + roff(option.get_description()) + (preset.empty() ? "" : " (default: " + roff(preset) + ")") + ".\n";
}

std::string upper(std::string text) {
  for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return text;
}

/// As the one line of NAME: without the program's own name, a lower-case beginning and no full stop.
std::string one_line(const Program& program, std::string about) {
  if (const std::string own = upper(program.name) + ": "; upper(about).starts_with(own)) about.erase(0, own.size());
  while (!about.empty() && (about.back() == '\n' || about.back() == '.')) about.pop_back();
  const bool capital = about.size() > 1 && about[0] >= 'A' && about[0] <= 'Z' && about[1] >= 'a' && about[1] <= 'z';
  if (capital) about[0] = static_cast<char>(about[0] - 'A' + 'a');
  return about;
}

std::string head(const Program& program, const std::string& page, const std::string& about) {
  std::string version = program_version();
  if (!version.empty()) version[0] = upper(version.substr(0, 1))[0];
  return fmt::format(".TH {} 1 \"\" \"{}\" \"{} manual\"\n.SH NAME\n{} \\- {}\n", roff(upper(page)), roff(version),
                     roff(upper(program.name.substr(0, 1)) + program.name.substr(1)), roff(page),
                     roff(one_line(program, about)));
}

/// The sections given for a page: the first, its description, comes before the generated ones, the others after them.
struct GivenSections {
  GivenSections(const ManualSections& sections, const std::string& page) : first(sections ? sections(page) : "") {
    const auto second = first.find("\n.SH ");
    if (second == std::string::npos) return;
    others = first.substr(second + 1);
    first.resize(second + 1);
  }
  std::string first, others;
};

std::string exit_status() {
  std::string codes = kExitCodes;
  codes.erase(0, codes.find(": ") + 2);
  return ".SH EXIT STATUS\n" + roff(codes) + "\n";
}

std::string command_page(const Program& program, const Command& command, const CLI::App& declared,
                         const ManualSections& sections) {
  const std::string name = program.name + "-" + command.name;
  std::string page = head(program, name, command.about);
  page += fmt::format(".SH SYNOPSIS\n.B {} {}\n", roff(program.name), roff(command.name));
  std::string options;
  bool any_option = false;
  for (const CLI::Option* option : shown_options(declared)) {
    if (option->get_positional()) {
      page += "\\fI" + roff(option->get_name()) + "\\fP" + (option->get_items_expected_max() > 1 ? "...\n" : "\n");
    } else {
      any_option = true;
    }
    add_option(options, *option);
  }
  if (any_option) page += "[\\fIoption\\fP...]\n";
  const GivenSections given(sections, name);
  page += given.first;
  page += ".SH OPTIONS\n" + options;
  std::string footer = declared.get_footer();  // what else its help says
  if (const auto codes = footer.find(kExitCodes); codes != std::string::npos) footer.resize(codes);
  if (!footer.empty()) page += ".PP\n" + roff(footer);
  page += exit_status() + given.others;
  page += fmt::format(".SH SEE ALSO\n.BR {} (1)\n", roff(program.name));
  return page;
}

std::string program_page(const Program& program, const CLI::App& declared, const ManualSections& sections) {
  std::string page = head(program, program.name, program.about);
  page += fmt::format(".SH SYNOPSIS\n.B {}\n\\fIcommand\\fP [\\fIoption\\fP...]\n", roff(program.name));
  const GivenSections given(sections, program.name);
  page += given.first;
  page += ".SH COMMANDS\n";
  std::string see_also;
  for (const Command& command : program.commands) {
    page += fmt::format(".TP\n.B {}\n{}.\n", roff(command.name), roff(command.about));
    see_also += (see_also.empty() ? "" : " ,\n") + fmt::format(".BR {} (1)", roff(program.name + "-" + command.name));
  }
  page += ".SH OPTIONS\n";
  for (const CLI::Option* option : shown_options(declared)) add_option(page, *option);
  return page + exit_status() + given.others + ".SH SEE ALSO\n" + see_also + "\n";
}

/// Options whose value may name a file of a folder of the configuration; which ones do is in their help.
constexpr std::array<std::pair<std::string_view, const char*>, 5> kConfigured{{{"--machine", "machines"},
                                                                               {"--scenario", "scenarios"},
                                                                               {"--device", "devices"},
                                                                               {"--device-file", "devices"},
                                                                               {"--impairment", "links"}}};

const char* configured_kind(const CLI::Option& option) {
  if (option.get_description().find("name or .toml file") == std::string::npos) return nullptr;
  const auto known = std::find_if(kConfigured.begin(), kConfigured.end(),
                                  [&option](const auto& entry) { return entry.first == option.get_name(); });
  return known == kConfigured.end() ? nullptr : known->second;
}

void append_word(std::string& line, const std::string& word) {
  line += (line.empty() ? "" : " ") + word;
}

/// The lines of `case $command in` that say what a command takes.
std::string command_case(const Command& command, const CLI::App& declared) {
  std::string all, valued, kinds;
  for (const CLI::Option* option : shown_options(declared)) {
    for (const std::string& name : names_of(*option)) {
      append_word(all, name);
      if (takes_value(*option)) append_word(valued, name);
    }
    if (const char* kind = configured_kind(*option)) append_word(kinds, option->get_name() + ":" + kind);
  }
  return fmt::format("    {})\n      all='{}'\n      valued='{}'\n      kinds='{}'\n      ;;\n", command.name, all,
                     valued, kinds);
}

constexpr const char* kCompletion = R"bash(# bash completion for @program@; generated from its options.
_@function@()
{
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}
  local all='' valued='' kinds='' kind names='' folder
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    mapfile -t COMPREPLY < <(compgen -W '@commands@' -- "$current")
    return
  fi
  case ${COMP_WORDS[1]} in
@cases@  esac
  if [[ " $valued " == *" $previous "* ]]; then
    folder=${KNUCKLE_CONFIG_DIR:-$(dirname "$(type -P "$1")")/../share/knuckle}
    for kind in $kinds; do
      [[ ${kind%:*} == "$previous" && -d $folder/${kind#*:} ]] || continue
      names=$(cd "$folder/${kind#*:}" && printf '%s ' *.toml)
    done
    mapfile -t COMPREPLY < <(compgen -W "${names//.toml/}" -- "$current"; compgen -f -- "$current")
  elif [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$all" -- "$current")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  fi
}
complete -o filenames -F _@function@ @program@
)bash";

void replace(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

}  // namespace

std::vector<ManualPage> manual_pages(const Program& program, const ManualSections& sections) {
  CLI::App app(program.about, program.name);
  (void)declare(program, app);
  std::vector<ManualPage> pages{{program.name, program_page(program, app, sections)}};
  for (const Command& command : program.commands) {
    pages.push_back({program.name + "-" + command.name,
                     command_page(program, command, *app.get_subcommand(command.name), sections)});
  }
  return pages;
}

std::string bash_completion(const Program& program) {
  CLI::App app(program.about, program.name);
  (void)declare(program, app);
  std::string commands, cases, function = program.name;
  for (const Command& command : program.commands) {
    append_word(commands, command.name);
    cases += command_case(command, *app.get_subcommand(command.name));
  }
  for (const CLI::Option* option : shown_options(app)) {
    for (const std::string& name : names_of(*option)) append_word(commands, name);
  }
  std::replace(function.begin(), function.end(), '-', '_');
  std::string script = kCompletion;
  for (const auto& [mark, text] : {std::pair<std::string, std::string>{"@program@", program.name},
                                   {"@function@", function},
                                   {"@commands@", commands},
                                   {"@cases@", cases}})
    replace(script, mark, text);
  return script;
}

}  // namespace knuckle::cli
