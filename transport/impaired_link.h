// A network between operator and machine on virtual time, as good or bad as its two directions are set. Seeded: the
// same calls give the same fate to every datagram.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/time.h"
#include "transport/impaired_path.h"
#include "transport/link.h"

namespace knuckle {

class ImpairedLink {
 public:
  static constexpr std::size_t kInFlight = ImpairedPath::kInFlight;  ///< Per direction.

  /// @throws InputError where a probability is outside [0, 1] or a duration is negative.
  ImpairedLink(const LinkImpairment& a_to_b, const LinkImpairment& b_to_a, std::uint64_t seed);
  ImpairedLink(const ImpairedLink&) = delete;
  ImpairedLink& operator=(const ImpairedLink&) = delete;

  [[nodiscard]] Link& a() noexcept { return a_; }
  [[nodiscard]] Link& b() noexcept { return b_; }
  /// Sets the time: what is due by then can be received; what is sent from now on leaves at `now`.
  void advance(Time now) noexcept { now_ = now; }
  /// Loses everything sent while on, both ways;
  void cut(bool on) noexcept {
    a_.cut(on);
    b_.cut(on);
  }
  /// or only what b sends.
  void cut_b_to_a(bool on) noexcept { b_.cut(on); }
  /// Everything sent from now on takes so much longer, both ways.
  void slow_down(Duration by) noexcept {
    a_to_b_.model().slow_down(by);
    b_to_a_.model().slow_down(by);
  }
  /// Of what b sends from now on, this share more is lost.
  void lose_more_b_to_a(double share) noexcept { b_to_a_.model().lose_more(share); }
  [[nodiscard]] const ImpairmentCounts& a_to_b() const noexcept { return a_to_b_.counts(); }
  [[nodiscard]] const ImpairmentCounts& b_to_a() const noexcept { return b_to_a_.counts(); }

 private:
  class End final : public Link {
   public:
    End(ImpairedLink& link, ImpairedPath& out, ImpairedPath& in) noexcept : link_(link), out_(out), in_(in) {}
    bool send(std::span<const std::uint8_t> bytes) noexcept override;
    bool receive(Datagram& datagram) noexcept override;
    void cut(bool on) noexcept { cut_ = on; }

   private:
    ImpairedLink& link_;
    ImpairedPath& out_;
    ImpairedPath& in_;
    bool cut_ = false;
  };

  Time now_{};
  ImpairedPath a_to_b_, b_to_a_;
  End a_, b_;
};

}  // namespace knuckle
