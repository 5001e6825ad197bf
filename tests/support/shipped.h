// The machine files that are delivered.
#pragma once

#include <string>

#include "machine/file_text.h"
#include "machine/load.h"
#include "tests/support/places.h"

namespace knuckle::test {

inline std::string shipped_file(const std::string& name) {
  return source_dir() + "/config/machines/" + name + ".toml";
}
inline std::string shipped_text(const std::string& name = "solar015") {
  return whole_file(shipped_file(name), 1);
}
inline MachineDescription shipped(const std::string& name) {
  return load_machine(shipped_file(name));
}

}  // namespace knuckle::test
