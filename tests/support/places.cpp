#include "tests/support/places.h"

namespace knuckle::test {

std::string source_dir() {
  return KNUCKLE_SOURCE_DIR;
}

std::string program(const std::string& name) {
  return KNUCKLE_PROGRAMS_DIR "/" + name;
}

}  // namespace knuckle::test
