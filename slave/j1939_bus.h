// The J1939 side of the machine bus: who sends each parameter group that the machine file reads, so that two senders
// are no one truth; messages of several packets; the address that Knuckle claims where it has to speak; and requests
// for what comes only when asked for (SAE J1939-21, -81).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/reason.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "transport/can_bus.h"
#include "transport/j1939_packets.h"

namespace knuckle::slave {

/// What people are told, and nothing stops for.
struct J1939News {
  enum class What : std::uint8_t {
    kOtherSender,  ///< `other` sends a group beside `address`, whose values count.
    kOtherDevice,  ///< `address`, which sends a group, is claimed by another device than before.
    kContested,    ///< Another device wants the address that is Knuckle's, and has the lower priority.
    kAddressLost,  ///< And has the higher one, so that Knuckle has none.
    kPacketLost,   ///< `packet` of a message of `packets` from `address` did not come, so that it was thrown away.
  } what = What::kOtherSender;
  Time at = kNever;
  std::uint8_t broadcast = 0;  ///< Place in BusDescription::broadcasts, which has no more than signals.
  std::uint8_t address = 0, other = 0;
  std::uint64_t name = 0;  ///< Of the device that claims.
  std::uint8_t packet = 0, packets = 0;
};
/// "engine (PGN 0xF004): also comes from 0x17; ...". Allocates.
[[nodiscard]] std::string text(const J1939News& news, const BusDescription& bus);

class J1939Bus {
 public:
  static constexpr Duration kStands = 1s;         ///< Another sender is a reason for so long.
  static constexpr Duration kClaimWaits = 250ms;  ///< For those who have the address already.
  static constexpr Duration kToldAgain = 10s;     ///< A group that loses packets is told so often.
  static constexpr std::size_t kKept = 8;
  /// NAME (J1939-81): construction (industry group 3), no function or vehicle system that the standard lists, a
  /// manufacturer code that is not assigned to Knuckle and the highest there is: nearly every device goes first.
  static constexpr std::uint64_t kName =
      std::uint64_t{3} << 60 | std::uint64_t{0x7F} << 49 | std::uint64_t{0xFF} << 40 | std::uint64_t{0x7FF} << 21 | 1;

  explicit J1939Bus(const BusDescription& bus);

  /// A received frame. Of a parameter group it gets the identifier that the machine file has for it.
  /// @return false where it has no values that count: another device sends that group, or it is a part of a message.
  [[nodiscard]] bool receive(CanFrame& frame, Time now) noexcept;
  /// The message of several packets that the frame before was the last of; until the next one.
  struct Message {
    std::uint32_t id = 0;  ///< That the machine file has for the group.
    std::span<const std::uint8_t> data;
  };
  [[nodiscard]] std::optional<Message> message() const noexcept;
  /// Once a step: claims the address, answers for it, and asks for what is due.
  void step(CanBus& bus, Time now) noexcept;

  /// kGroupTwice where two devices send what the machine is led by, for kStands; kAddressLost where commands go out
  /// from the address that was lost; else kNone.
  [[nodiscard]] Reason fault(Time now) const noexcept;
  /// Whether command frames may go out: from an address only once it is claimed.
  [[nodiscard]] bool may_command() const noexcept { return !commands_ || claim_ == Claim::kHeld; }

  /// How many news there were since construction; the last kKept are kept.
  [[nodiscard]] std::uint64_t news_count() const noexcept { return told_; }
  [[nodiscard]] const J1939News& news(std::uint64_t number) const noexcept { return news_[number % kKept]; }

 private:
  enum class Claim : std::uint8_t { kNone, kUnsaid, kSaid, kHeld, kLost };
  struct Group {
    std::uint8_t broadcast = 0;  ///< Its first place in BusDescription::broadcasts.
    CanFilter filter;
    std::optional<std::uint8_t> source;   ///< That the machine file gives.
    std::optional<std::uint8_t> subject;  ///< Of a reason, where the machine is led by it.
    Duration period{};
    std::uint8_t bytes = 0;
    bool on_request = false;
    std::uint8_t sender = 0;
    Time heard_at = kNever;  ///< From the sender.
    std::uint8_t other = 0;
    Time other_at = kNever;
    Time asked_at = kNever;
    j1939::PacketReader packets{};
    std::uint8_t packets_from = 0;
    Time lost_told_at = kNever;
    [[nodiscard]] bool counts(std::uint8_t from, Time now) const noexcept;
    /// Whether nobody can tell which of the two is right.
    [[nodiscard]] bool is_fault() const noexcept { return subject && !source; }
    [[nodiscard]] std::uint8_t asked() const noexcept;
  };
  /// The one that a frame is of. @return nullopt where it is of none; null where its values do not count, which is
  /// noted
  [[nodiscard]] std::optional<Group*> group_of(std::uint32_t id, Time now) noexcept;
  /// @return whether it is a part of a message for everybody
  [[nodiscard]] bool on_part(const CanFrame& frame, std::uint8_t from, Time now) noexcept;
  void on_announcement(const j1939::Announcement& said, std::uint32_t bus, std::uint8_t from, Time now) noexcept;
  void lose(Group& group, const std::optional<j1939::PacketReader::Lost>& lost, Time now) noexcept;
  void on_claim(std::uint64_t name, std::uint8_t address, Time now) noexcept;
  void on_own_address(std::uint64_t name, Time now) noexcept;
  void note_name(std::uint64_t name, std::uint8_t address, Time now) noexcept;
  void say_claim(CanBus& bus, Time now) noexcept;
  void tell(const J1939News& news) noexcept { news_[told_++ % kKept] = news; }

  std::vector<Group> groups_;  // sized once, at construction
  static constexpr std::size_t kNoGroup = ~std::size_t{0};
  std::size_t whole_ = kNoGroup;  // whose message is complete
  std::uint8_t address_ = 0;
  bool commands_ = false;  // from that address
  std::uint32_t on_ = 0;   // kSecondBus where it speaks there
  Claim claim_ = Claim::kNone;
  Time said_at_ = kNever, answer_at_ = kNever, contested_at_ = kNever;
  bool answers_ = false;                    // at answer_at_
  bool was_gone_ = false;                   // either bus, in the step before
  std::array<std::uint64_t, 256> names_{};  // by address; 0: none heard
  std::array<J1939News, kKept> news_{};
  std::uint64_t told_ = 0;
};

}  // namespace knuckle::slave
