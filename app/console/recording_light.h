// What becomes of the recording, for the light on every screen.
#pragma once

#include <cstdint>
#include <string>

namespace knuckle::console {

struct RecordingLight {
  enum class State : std::uint8_t { kOff, kOn, kStopped };
  State state = State::kOff;
  bool real = false;             ///< Something real is driven: that it is not recorded stands out.
  std::uint64_t free_bytes = 0;  ///< On the disk; 0: not known yet.
  std::uint64_t steps_lost = 0;  ///< Of the loops, for which there was no room.
  std::string why;               ///< Of kStopped.
};

}  // namespace knuckle::console
