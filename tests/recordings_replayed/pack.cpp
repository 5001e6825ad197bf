// What replay needs of a recording, as small as it can be: scripts/regression-recordings makes the files of this folder
// with it.
//   pack_recording FROM TO both|machine
#include <iostream>
#include <string>

#include "tests/recording/rewrite.h"

namespace {

void pack(const std::string& from, const std::string& to, bool both) {
  constexpr int kSmallest = 22;  // of zstd's levels
  knuckle::recording::Head head = knuckle::recording::Recording({from}).head();
  head.has_operator = both;
  knuckle::test::rewrite(from, to, head, {kSmallest}, [&](const std::string& topic, auto&) {
    return topic.starts_with("/machine/") || topic == "/events" || (both && topic.starts_with("/operator/"));
  });
}

}  // namespace

int main(int argc, char** argv) {
  const std::string sides = argc == 4 ? argv[3] : "";
  if (sides != "both" && sides != "machine") {
    std::cerr << "usage: pack_recording FROM TO both|machine\n";
    return 2;
  }
  try {
    pack(argv[1], argv[2], sides == "both");
  } catch (const std::exception& error) {
    std::cerr << "pack_recording: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
