#include "recording/mcap/compression.h"

#include <lz4frame.h>
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

void Lz4Decompressor::Free::operator()(LZ4F_dctx_s* context) const noexcept {
  LZ4F_freeDecompressionContext(context);
}

bool Lz4Decompressor::decompress(std::span<const std::uint8_t> bytes, std::size_t size, Bytes& to) {
  if (!context_) {
    LZ4F_dctx* made = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) return false;
    context_.reset(made);
  }
  LZ4F_resetDecompressionContext(context_.get());  // the last one may have ended in the middle of a frame
  to.resize(size);
  std::size_t written = 0, wanted = 1;  // of the frame, as it says; 0 at its end
  while (!bytes.empty()) {
    std::size_t room = size - written, taken = bytes.size();
    wanted = LZ4F_decompress(context_.get(), to.data() + written, &room, bytes.data(), &taken, nullptr);
    if (LZ4F_isError(wanted) != 0 || (taken == 0 && room == 0)) return false;
    written += room;
    bytes = bytes.subspan(taken);
  }
  return wanted == 0 && written == size;
}

}  // namespace knuckle::mcap
