// Keys of sealed pictures, by number.
#pragma once

#include <cstdint>

#include "video/sealing.h"

namespace knuckle::video {

inline PictureKey key_of(std::uint8_t number) {
  PictureKey key;
  key.fill(number);
  return key;
}

}  // namespace knuckle::video
