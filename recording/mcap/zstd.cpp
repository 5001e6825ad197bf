#include "recording/mcap/zstd.h"

#include <zstd.h>

#include <algorithm>

namespace knuckle::mcap {

void ZstdCompressor::Free::operator()(ZSTD_CCtx_s* context) const noexcept {
  ZSTD_freeCCtx(context);
}
void ZstdDecompressor::Free::operator()(ZSTD_DCtx_s* context) const noexcept {
  ZSTD_freeDCtx(context);
}

bool ZstdCompressor::compress(std::span<const std::uint8_t> bytes, int level, Bytes& to) {
  if (!context_) context_.reset(ZSTD_createCCtx());
  if (!context_) return false;
  const std::size_t at = to.size();
  to.resize(at + ZSTD_compressBound(bytes.size()));
  const int possible = std::clamp(level, ZSTD_minCLevel(), ZSTD_maxCLevel());
  const std::size_t size =
      ZSTD_compressCCtx(context_.get(), to.data() + at, to.size() - at, bytes.data(), bytes.size(), possible);
  const bool done = ZSTD_isError(size) == 0;
  to.resize(at + (done ? size : 0));
  return done;
}

bool ZstdDecompressor::decompress(std::span<const std::uint8_t> bytes, std::size_t size, Bytes& to) {
  if (!context_) context_.reset(ZSTD_createDCtx());
  if (!context_) return false;
  to.resize(size);
  // With an error it returns a number near the largest there is.
  return ZSTD_decompressDCtx(context_.get(), to.data(), size, bytes.data(), bytes.size()) == size;
}

}  // namespace knuckle::mcap
