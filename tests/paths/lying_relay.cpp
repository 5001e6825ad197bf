#include "tests/paths/lying_relay.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <iostream>
#include <random>
#include <span>
#include <vector>

#include "transport/udp_socket.h"

namespace knuckle::test {
namespace {

using Bytes = std::vector<std::uint8_t>;
enum class Lie { kNone, kAround, kFlips, kDrops };
constexpr std::array kLies{Lie::kNone, Lie::kFlips, Lie::kNone, Lie::kAround, Lie::kNone, Lie::kDrops, Lie::kNone};
constexpr std::size_t kEarlier = 200, kChannelHeader = 4, kStunHeader = 20, kDataAttribute = 0x0013;

std::size_t word(const Bytes& datagram, std::size_t at) {
  return static_cast<std::size_t>(datagram[at] << 8 | datagram[at + 1]);
}

/// What of a datagram is relayed: of channel data, or of a Send or Data indication (RFC 5766). Empty: nothing is.
std::span<std::uint8_t> relayed(Bytes& datagram) {
  if (datagram.size() > kChannelHeader && datagram[0] >= 0x40 && datagram[0] < 0x50)
    return std::span(datagram).subspan(kChannelHeader);
  if (datagram.size() <= kStunHeader || datagram[0] != 0 || (datagram[1] | 1U) != 0x17) return {};
  for (std::size_t at = kStunHeader; at + 4 <= datagram.size();) {
    const std::size_t size = word(datagram, at + 2);
    if (at + 4 + size > datagram.size()) break;
    if (word(datagram, at) == kDataAttribute) return std::span(datagram).subspan(at + 4, size);
    at += 4 + (size + 3) / 4 * 4;
  }
  return {};
}

class Liar {
 public:
  /// What becomes of a datagram of one end's.
  std::vector<Bytes> tell(Bytes datagram, Lie lie, std::deque<Bytes>& earlier) {
    if (relayed(datagram).empty()) return {datagram};
    earlier.push_back(datagram);
    if (earlier.size() > kEarlier) earlier.pop_front();
    switch (lie) {
      case Lie::kNone:
        break;
      case Lie::kAround:
        return {flipped(datagram), datagram, flipped(datagram), earlier[random_() % earlier.size()], datagram};
      case Lie::kFlips:
        return {flipped(datagram)};
      case Lie::kDrops:
        return {};
    }
    return {datagram};
  }

 private:
  Bytes flipped(Bytes one) {
    const auto content = relayed(one);
    content[random_() % content.size()] ^= static_cast<std::uint8_t>(1U << (random_() % 8));
    return one;
  }
  std::mt19937_64 random_{7};
};

struct End {
  SocketAddress address;
  UdpSocket to_turn;
  std::deque<Bytes> sent, heard;
};

}  // namespace

void run_lying_relay(const std::string& listen, const std::string& turn, const volatile std::sig_atomic_t& steps,
                     const volatile std::sig_atomic_t& ended) {
  const UdpSocket inner(open_udp_socket(listen, parse_address(listen), ::bind, "listen on"));
  std::vector<End> ends;
  Liar liar;
  std::cout << "listening" << std::endl;
  while (ended == 0) {
    std::vector<pollfd> all{{inner.descriptor(), POLLIN, 0}};
    for (const End& one : ends) all.push_back({one.to_turn.descriptor(), POLLIN, 0});
    (void)::poll(all.data(), all.size(), 100);
    const Lie lie = kLies[std::min<std::size_t>(static_cast<std::size_t>(steps), kLies.size() - 1)];
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    const auto took = [&](const UdpSocket& socket) {
      const auto arrival = socket.receive(bytes, from);
      return arrival ? std::optional(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(arrival->size)))
                     : std::nullopt;
    };
    while (const auto datagram = took(inner)) {
      auto end = std::find_if(ends.begin(), ends.end(), [&](const End& one) { return one.address == from; });
      if (end == ends.end()) {
        UdpSocket to_turn(open_udp_socket(turn, parse_address(turn), ::connect, "reach"));
        end = ends.insert(ends.end(), {from, std::move(to_turn), {}, {}});
      }
      for (const Bytes& one : liar.tell(*datagram, lie, end->sent)) (void)end->to_turn.send(one, {});
    }
    for (End& end : ends) {
      while (const auto datagram = took(end.to_turn)) {
        for (const Bytes& one : liar.tell(*datagram, lie, end.heard)) (void)inner.send(one, end.address);
      }
    }
  }
}

}  // namespace knuckle::test
