// One-shot compression of chunks: zstd, and LZ4 frames as other writers have them. Contexts are kept, as making one
// costs more than a small chunk.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "recording/mcap/contents.h"

struct LZ4F_dctx_s;
struct ZSTD_CCtx_s;
struct ZSTD_DCtx_s;

namespace knuckle::mcap {

class ZstdCompressor {
 public:
  /// Appends to `to`. @param level 1 to 22, negative ones are faster and compress less; clamped to what zstd has.
  /// @return false where there is no memory for it; then nothing is appended.
  [[nodiscard]] bool compress(std::span<const std::uint8_t> bytes, int level, Bytes& to);

 private:
  struct Free {
    void operator()(ZSTD_CCtx_s* context) const noexcept;
  };
  std::unique_ptr<ZSTD_CCtx_s, Free> context_;
};

class ZstdDecompressor {
 public:
  /// Overwrites `to`. @return false where the bytes do not decompress to exactly `size`.
  [[nodiscard]] bool decompress(std::span<const std::uint8_t> bytes, std::size_t size, Bytes& to);

 private:
  struct Free {
    void operator()(ZSTD_DCtx_s* context) const noexcept;
  };
  std::unique_ptr<ZSTD_DCtx_s, Free> context_;
};

// LZ4 frames, as other writers of MCAP compress chunks.

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
