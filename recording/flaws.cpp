#include "recording/flaws.h"

namespace knuckle::recording {

std::vector<std::string> flaws(const Recording& recording) {
  std::vector<std::string> all = recording.damages();
  if (!recording.complete())
    all.push_back(recording.source() + ": has no end: its program was killed, or the disk refused the rest");
  return all;
}

}  // namespace knuckle::recording
