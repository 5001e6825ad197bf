#include "recording/mcap/lz4.h"

#include <lz4frame.h>

namespace knuckle::mcap {

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
