#include "slave/j1939_bus.h"

#include <fmt/format.h>

#include <algorithm>

#include "machine/reason_text.h"
#include "transport/j1939.h"

namespace knuckle::slave {
namespace {

constexpr double kPeriodsHeard = 3.5;  // three frames may be lost

/// What the machine is led by, of a group.
std::optional<std::uint8_t> subject_in(const BroadcastFrame& frame) {
  for (const BroadcastField& field : frame.fields)
    if (field.info().role != NodeRole::kReading) return signal_subject(field.signal);
  return std::nullopt;
}

/// J1939-81: that there is no address is said after a delay that differs from device to device, up to 153 ms.
Duration delay_by(std::uint64_t name) noexcept {
  return std::chrono::microseconds(600) * static_cast<int>(name & 0xFFU);
}

}  // namespace

J1939Bus::J1939Bus(const BusDescription& bus) : commands_(bus.commands_by_address()) {
  for (std::size_t place = 0; place < bus.broadcasts.size(); ++place) {
    const BroadcastFrame& frame = bus.broadcasts[place];
    if (!frame.is_group()) continue;
    const Group group{.broadcast = static_cast<std::uint8_t>(place),
                      .filter = frame.filter(),
                      .source = frame.source,
                      .subject = subject_in(frame),
                      .period = from_seconds(frame.period_s),
                      .bytes = frame.bytes,
                      .on_request = frame.on_request};
    const auto known =
        std::find_if(groups_.begin(), groups_.end(), [&](const Group& one) { return one.filter.id == frame.id; });
    if (known == groups_.end()) {
      groups_.push_back(group);
      continue;
    }
    // What a multiplexer tells apart has one sender.
    if (!known->subject) known->subject = group.subject;
    known->period = std::min(known->period, group.period);
  }
  if (!bus.j1939_address) return;
  address_ = *bus.j1939_address;
  on_ = bus.j1939_line();
  claim_ = Claim::kUnsaid;
}

/// The one that was heard first, until it falls silent: a device may get another address.
bool J1939Bus::Group::counts(std::uint8_t from, Time now) const noexcept {
  if (source) return from == *source;
  return from == sender || heard_at == kNever ||
         now - heard_at > std::max(kStands, from_seconds(kPeriodsHeard * to_seconds(period)));
}

/// What does not fit into a frame is sent to everybody only where everybody was asked (J1939-21, 5.4.2): who is asked
/// alone answers over a connection to whoever asks, RTS and CTS, which Knuckle does not take part in.
std::uint8_t J1939Bus::Group::asked() const noexcept {
  if (j1939::in_packets(bytes)) return j1939::kEverybody;
  if (source) return *source;
  return heard_at == kNever ? j1939::kEverybody : sender;
}

bool J1939Bus::receive(CanFrame& frame, Time now) noexcept {
  whole_ = kNoGroup;
  if ((frame.id & kExtendedId) == 0) return true;
  const std::uint8_t from = j1939::source_of(frame.id);
  CanFrame alone = frame;
  alone.id ^= on_;  // as if there were one bus
  if (const auto name = j1939::claimed_name(alone)) on_claim(*name, from, now);
  if (j1939::requested(alone) == j1939::kAddressClaim && j1939::is_for(address_, alone.id) && claim_ >= Claim::kHeld) {
    answers_ = true;
    answer_at_ = now;
  }
  if (on_part(frame, from, now)) return false;
  const auto group = group_of(frame.id, now);
  if (group && *group != nullptr) frame.id = (*group)->filter.id;
  return !group || *group != nullptr;
}

std::optional<J1939Bus::Group*> J1939Bus::group_of(std::uint32_t id, Time now) noexcept {
  const std::uint8_t from = j1939::source_of(id);
  Group* foreign = nullptr;
  for (Group& group : groups_) {
    if (!group.filter.lets(id)) continue;
    if (group.counts(from, now)) {
      group.sender = from;
      group.heard_at = now;
      return &group;
    }
    foreign = &group;
  }
  if (foreign == nullptr) return std::nullopt;
  const bool is_new = now - foreign->other_at > kStands || foreign->other != from;
  foreign->other = from;
  foreign->other_at = now;
  if (is_new && !foreign->is_fault())
    tell({.what = J1939News::What::kOtherSender,
          .at = now,
          .broadcast = foreign->broadcast,
          .address = foreign->source.value_or(foreign->sender),
          .other = from});
  return nullptr;
}

bool J1939Bus::on_part(const CanFrame& frame, std::uint8_t from, Time now) noexcept {
  const std::uint32_t bus = frame.id & kSecondBus;
  CanFrame alone = frame;
  alone.id ^= bus;
  if (const auto said = j1939::announced(alone)) {
    on_announcement(*said, bus, from, now);
    return true;
  }
  const auto number = j1939::packet_number(alone);
  for (Group& group : groups_) {
    if (!number || !group.packets.under_way() || group.packets_from != from) continue;
    if ((group.filter.id & kSecondBus) != bus) continue;
    group.heard_at = now;
    const auto lost = group.packets.add(*number, alone, now);
    lose(group, lost, now);
    if (!lost && !group.packets.under_way()) whole_ = static_cast<std::size_t>(&group - groups_.data());
  }
  return number.has_value();
}

/// A device sends one message to everybody at a time: the one before is over, complete or not.
void J1939Bus::on_announcement(const j1939::Announcement& said, std::uint32_t bus, std::uint8_t from,
                               Time now) noexcept {
  for (Group& group : groups_)
    if (group.packets_from == from && (group.filter.id & kSecondBus) == bus) lose(group, group.packets.end(), now);
  const auto of = group_of(j1939::identifier(said.group, from) | bus, now);
  if (!of || *of == nullptr || !j1939::in_packets((*of)->bytes)) return;
  Group& group = **of;
  lose(group, group.packets.end(), now);
  group.packets_from = from;
  group.packets.begin(said, now);
}

void J1939Bus::lose(Group& group, const std::optional<j1939::PacketReader::Lost>& lost, Time now) noexcept {
  if (!lost || (group.lost_told_at != kNever && now - group.lost_told_at < kToldAgain)) return;
  group.lost_told_at = now;
  tell({.what = J1939News::What::kPacketLost,
        .at = now,
        .broadcast = group.broadcast,
        .address = group.packets_from,
        .packet = lost->packet,
        .packets = lost->of});
}

std::optional<J1939Bus::Message> J1939Bus::message() const noexcept {
  if (whole_ == kNoGroup) return std::nullopt;
  return Message{groups_[whole_].filter.id, groups_[whole_].packets.message()};
}

void J1939Bus::on_claim(std::uint64_t name, std::uint8_t address, Time now) noexcept {
  if (claim_ == Claim::kNone || address > j1939::kMostAddress) return;
  if (address == address_)
    on_own_address(name, now);
  else
    note_name(name, address, now);
}

/// The lower NAME keeps it; of two that are equal neither could tell that it has.
void J1939Bus::on_own_address(std::uint64_t name, Time now) noexcept {
  using What = J1939News::What;
  if (claim_ == Claim::kLost) return;
  answers_ = true;
  if (name <= kName) {
    claim_ = Claim::kLost;
    answer_at_ = now + delay_by(name);
    return tell({.what = What::kAddressLost, .at = now, .address = address_, .name = name});
  }
  answer_at_ = now;
  if (now - contested_at_ > kStands) tell({.what = What::kContested, .at = now, .address = address_, .name = name});
  contested_at_ = now;
}

void J1939Bus::note_name(std::uint64_t name, std::uint8_t address, Time now) noexcept {
  const std::uint64_t before = names_[address];
  names_[address] = name;
  const auto sends = [this, address](const Group& group) {
    if ((group.filter.id & kSecondBus) != on_) return false;
    return group.source ? *group.source == address : group.heard_at != kNever && group.sender == address;
  };
  const auto group = std::find_if(groups_.begin(), groups_.end(), sends);
  if (before == 0 || before == name || group == groups_.end()) return;
  tell({.what = J1939News::What::kOtherDevice,
        .at = now,
        .broadcast = group->broadcast,
        .address = address,
        .name = name});
}

void J1939Bus::step(CanBus& bus, Time now) noexcept {
  for (Group& group : groups_) lose(group, group.packets.step(now), now);
  if (claim_ == Claim::kNone) return;
  // Who was there meanwhile is not known: claimed anew. Another bus that fails changes nothing: there neutral must go
  // out from the address.
  const CanState state = bus.state();
  const bool own = (bus.state_of() != 0) == (on_ != 0);
  const bool any = state == CanState::kBusOff || state == CanState::kDown, gone = any && own;
  if (gone && claim_ != Claim::kLost) claim_ = Claim::kUnsaid;
  // Perhaps both were gone, of which one is told: who has taken the address meanwhile answers.
  if (was_gone_ && !any && claim_ == Claim::kHeld) {
    answers_ = true;
    answer_at_ = now;
  }
  was_gone_ = any;
  if (gone) return;
  say_claim(bus, now);
  if (claim_ == Claim::kSaid && now - said_at_ >= kClaimWaits) claim_ = Claim::kHeld;
  if (claim_ != Claim::kHeld) return;
  for (Group& group : groups_) {
    if (!group.on_request || (group.asked_at != kNever && now - group.asked_at < group.period)) continue;
    CanFrame asks = j1939::request_frame(j1939::group_of(group.filter.id), address_, group.asked());
    asks.id |= on_;
    if (bus.send(asks)) group.asked_at = now;
  }
}

/// What the bus does not take is said in the next step.
void J1939Bus::say_claim(CanBus& bus, Time now) noexcept {
  const auto say = [&](CanFrame frame) {
    frame.id |= on_;
    return bus.send(frame);
  };
  if (claim_ == Claim::kUnsaid) {
    if (!say(j1939::claim_frame(kName, address_))) return;
    // Who has which address: one that another device claims later is told.
    (void)say(j1939::request_frame(j1939::kAddressClaim, address_, j1939::kEverybody));
    claim_ = Claim::kSaid;
    said_at_ = now;
  }
  if (!answers_ || now < answer_at_) return;
  const std::uint8_t from = claim_ == Claim::kLost ? j1939::kNoAddress : address_;
  answers_ = !say(j1939::claim_frame(kName, from));
}

Reason J1939Bus::fault(Time now) const noexcept {
  if (commands_ && claim_ == Claim::kLost) return Reason(ReasonCode::kAddressLost, 0, address_);
  for (const Group& group : groups_) {
    if (group.is_fault() && now - group.other_at <= kStands)
      return Reason(ReasonCode::kGroupTwice, *group.subject, group.other, group.sender);
  }
  return {};
}

std::string text(const J1939News& news, const BusDescription& bus) {
  const auto frame = [&] { return frame_text(bus.broadcasts.at(news.broadcast), bus); };
  switch (news.what) {
    case J1939News::What::kOtherSender:
      return fmt::format(
          "{}: also comes from 0x{:02X}; the values of 0x{:02X} count: find out which is right, and give its address "
          "as "
          "source in the machine file",
          frame(), news.other, news.address);
    case J1939News::What::kOtherDevice:
      return fmt::format("{}: its sender's address 0x{:02X} is claimed by another device than before (NAME 0x{:016X})",
                         frame(), news.address, news.name);
    case J1939News::What::kContested:
      return fmt::format(
          "another device wants J1939 address 0x{:02X} (NAME 0x{:016X}); Knuckle keeps it: give that "
          "device, or bus.j1939_address, another one",
          news.address, news.name);
    case J1939News::What::kPacketLost:
      return fmt::format(
          "{}: packet {} of {} from 0x{:02X} did not come, so that message was thrown away: check the bus load, "
          "termination and plugs",
          frame(), news.packet, news.packets, news.address);
    case J1939News::What::kAddressLost:
      break;
  }
  return fmt::format(
      "J1939 address 0x{:02X} is another device's (NAME 0x{:016X}), so nothing is asked for any more: "
      "give bus.j1939_address one that nobody has, then start again",
      news.address, news.name);
}

}  // namespace knuckle::slave
