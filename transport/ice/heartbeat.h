// Whether a path carries datagrams both ways, and how long they take: small questions that only the far end of the path
// can answer, ten a second, beside what the ends send each other. Not authenticated: whoever is on the path can answer
// them, and could drop everything as well.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>

namespace knuckle::ice {

/// First byte: neither STUN (0-3), DTLS (20-63), nor TURN channels (64-79). An observer's tag may begin with it, too
/// (0x80 to 0xBF): but what the secure link sends is longer than a beat.
inline constexpr std::uint8_t kBeatMark = 0xB0;
inline constexpr std::size_t kBeatSize = 10;
using Beat = std::array<std::uint8_t, kBeatSize>;

class Heartbeat {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kEvery{100};

  [[nodiscard]] static bool is_beat(std::span<const std::uint8_t> datagram) noexcept {
    return datagram.size() == kBeatSize && datagram[0] == kBeatMark;
  }

  /// The next question, where it is time for one. @param in_use this end sends over the path.
  [[nodiscard]] std::optional<Beat> question(Clock::time_point now, bool in_use);
  /// @return the answer, where it is a question.
  [[nodiscard]] std::optional<Beat> hear(std::span<const std::uint8_t> datagram, Clock::time_point now);
  /// Asks at once.
  void hurry() noexcept { asked_at_ = {}; }

  [[nodiscard]] std::optional<Clock::time_point> answered_at() const noexcept { return answered_at_; }
  /// A question came.
  [[nodiscard]] std::optional<Clock::time_point> heard_at() const noexcept { return heard_at_; }
  [[nodiscard]] bool far_end_uses() const noexcept { return far_end_uses_; }
  /// Of the newest answer; taken once.
  [[nodiscard]] std::optional<Clock::duration> take_round_trip() noexcept;

 private:
  using Number = std::array<std::uint8_t, 8>;
  struct Asked {
    Number number{};
    Clock::time_point at{};
    bool open = false;
  };
  std::array<Asked, 32> asked_{};
  std::size_t next_ = 0;
  Clock::time_point asked_at_{};
  std::optional<Clock::time_point> answered_at_, heard_at_;
  std::optional<Clock::duration> round_trip_;
  bool far_end_uses_ = false;
};

}  // namespace knuckle::ice
