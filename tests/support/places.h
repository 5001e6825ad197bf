// Where the sources and the programs under test are. CMake says so to places.cpp alone: what is compiled of the tests
// is then the same in every clone, and a compiler cache finds it.
#pragma once

#include <string>

namespace knuckle::test {

/// The top of the source tree.
[[nodiscard]] std::string source_dir();
/// @param name "knuckle" or "knuckle-studies", as built.
[[nodiscard]] std::string program(const std::string& name);

}  // namespace knuckle::test
