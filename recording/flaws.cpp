#include "recording/flaws.h"

#include <algorithm>
#include <utility>

namespace knuckle::recording {

std::vector<std::string> flaws(const Recording& recording) {
  constexpr const char* kNoEnd = "has no end: its program was killed, or the disk refused the rest";
  std::vector<std::string> all = recording.damages();
  if (recording.complete()) return all;
  // What is cut off has no end: one line says both.
  const auto cut = std::find_if(all.rbegin(), all.rend(),
                                [](const std::string& line) { return line.find(": cut off") != std::string::npos; });
  if (cut != all.rend())
    *cut += "; it " + std::string(kNoEnd);
  else
    all.push_back(recording.source() + ": " + kNoEnd);
  return all;
}

std::vector<std::string> remarks(const Recording& recording) {
  std::vector<std::string> all = flaws(recording);
  for (std::string& note : recording.order_notes()) all.push_back(std::move(note));
  return all;
}

}  // namespace knuckle::recording
