// Manual pages and bash completion of a program, made from the options that its commands declare.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/cli/command.h"

namespace knuckle::cli {

struct ManualPage {
  std::string name;  ///< "knuckle", "knuckle-slave"; of section 1.
  std::string text;  ///< roff with the macros of man(7).
};

/// Sections in roff that options cannot tell, by the page's name: its description, then others; empty: none.
using ManualSections = std::function<std::string(const std::string& page)>;

/// The program's page, which lists the commands, and one for each command.
[[nodiscard]] std::vector<ManualPage> manual_pages(const Program& program, const ManualSections& sections = {});

/// A script that bash sources to complete commands, options, files, and the names of configuration files.
[[nodiscard]] std::string bash_completion(const Program& program);

}  // namespace knuckle::cli
