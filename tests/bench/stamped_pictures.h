// Pictures that carry their number in cells that survive an encoder, and that say when they were captured.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

#include "video/frame.h"

namespace knuckle {

class StampedPictures {
 public:
  static constexpr int kWidth_px = 1280, kHeight_px = 720, kFrames_per_s = 30;
  // In a row across the picture's middle: white, black, the number's bits, its parity.
  static constexpr int kBits = 12, kCells = kBits + 3, kCell_px = 80, kLeft_px = 40;
  static constexpr std::uint32_t kNumbers = 1U << kBits;

  /// A picture of now, and when that was.
  std::unique_ptr<video::Frame> next() {
    const std::uint32_t number = number_++ % kNumbers;
    const auto bytes = pictures_[number_ % pictures_.size()];
    draw(*bytes, number);
    auto frame = std::make_unique<video::Frame>();
    *frame = {.width_px = kWidth_px,
              .height_px = kHeight_px,
              .row_bytes = 4 * kWidth_px,
              .pixels = bytes->data(),
              .memory = bytes};
    frame->captured = video::now();
    captured_ns_[number] = frame->captured.time_since_epoch().count();
    return frame;
  }
  [[nodiscard]] Time captured(std::uint32_t number) const { return Time(Duration(captured_ns_[number])); }

  /// The number in a row of a picture, black to white; nullopt where it is not all there.
  template <typename Brightness>
  [[nodiscard]] static std::optional<std::uint32_t> read(double width_px, const Brightness& at) {
    const auto cell = [&](int i) {
      return at(static_cast<int>((kLeft_px + (i + 0.5) * kCell_px) * width_px / kWidth_px)) > 127;
    };
    if (!cell(0) || cell(1)) return std::nullopt;
    std::uint32_t number = 0;
    for (int i = 0; i < kBits; ++i) number |= (cell(2 + i) ? 1U : 0U) << i;
    if (cell(kCells - 1) != (std::popcount(number) % 2 == 0)) return std::nullopt;
    return number;
  }

 private:
  using Bytes = std::vector<std::uint8_t>;
  /// Stripes that move, and the cells.
  static void draw(Bytes& bytes, std::uint32_t number) {
    constexpr int kStripe_px = 16, kStep_px = 4;
    for (int x = 0; x < kWidth_px; ++x) {
      const auto shade = static_cast<std::uint8_t>(((x + kStep_px * static_cast<int>(number)) / kStripe_px * 37) % 200);
      std::memset(&bytes[static_cast<std::size_t>(4 * x)], shade, 4);
    }
    constexpr std::size_t kRow = std::size_t{4} * kWidth_px;
    for (std::size_t y = 1; y < kHeight_px; ++y) std::memcpy(&bytes[y * kRow], bytes.data(), kRow);
    for (int i = 0; i < kCells; ++i) {
      const bool white = i == 0            ? true
                         : i == 1          ? false
                         : i == kCells - 1 ? std::popcount(number) % 2 == 0
                                           : (number >> (i - 2) & 1U) != 0;
      for (int y = (kHeight_px - kCell_px) / 2; y < (kHeight_px + kCell_px) / 2; ++y)
        std::memset(
            &bytes[static_cast<std::size_t>(y) * kRow + static_cast<std::size_t>(4 * (kLeft_px + i * kCell_px))],
            white ? 255 : 0, std::size_t{4} * kCell_px);
    }
  }
  static std::array<std::shared_ptr<Bytes>, 4> memory() {
    std::array<std::shared_ptr<Bytes>, 4> all;
    for (auto& one : all) one = std::make_shared<Bytes>(std::size_t{4} * kWidth_px * kHeight_px);
    return all;
  }
  std::uint32_t number_ = 0;
  std::array<std::shared_ptr<Bytes>, 4> pictures_ = memory();  // longer than a sender keeps one
  std::array<std::atomic<std::int64_t>, kNumbers> captured_ns_{};
};

}  // namespace knuckle
