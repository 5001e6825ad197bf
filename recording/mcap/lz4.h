// LZ4 frames, as other writers of MCAP compress chunks.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "recording/mcap/contents.h"

struct LZ4F_dctx_s;

namespace knuckle::mcap {

class Lz4Decompressor {
 public:
  /// Overwrites `to`. @return false where the bytes are no whole frames that decompress to exactly `size`.
  [[nodiscard]] bool decompress(std::span<const std::uint8_t> bytes, std::size_t size, Bytes& to);

 private:
  struct Free {
    void operator()(LZ4F_dctx_s* context) const noexcept;
  };
  std::unique_ptr<LZ4F_dctx_s, Free> context_;
};

}  // namespace knuckle::mcap
