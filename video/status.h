// What became of a camera's connection last; plain data.
#pragma once

#include <array>
#include <cstdint>

namespace knuckle::video {

struct CameraStatus {
  bool playing = false;         ///< Pictures come.
  std::uint32_t troubles = 0;   ///< Counts problems up.
  std::uint64_t refused = 0;    ///< Packets that came and were not let in: not sealed with the key, or sent again.
  std::array<char, 400> why{};  ///< The last problem, one line with what to do; empty before the first.
};

}  // namespace knuckle::video
