#include "transport/impaired_link.h"

#include <cstring>

namespace knuckle {

ImpairedLink::ImpairedLink(const LinkImpairment& a_to_b, const LinkImpairment& b_to_a, std::uint64_t seed)
    : a_to_b_(a_to_b, 2 * seed, kMaxDatagram),
      b_to_a_(b_to_a, 2 * seed + 1, kMaxDatagram),
      a_(*this, a_to_b_, b_to_a_),
      b_(*this, b_to_a_, a_to_b_) {}

bool ImpairedLink::End::send(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() > kMaxDatagram) return false;
  if (cut_) {
    out_.model().lose();
  } else {
    out_.send(bytes, link_.now_);
  }
  return true;  // as with UDP: the sender does not learn of its fate
}

bool ImpairedLink::End::receive(Datagram& datagram) noexcept {
  const auto arrival = in_.front(link_.now_);
  if (!arrival) return false;
  datagram.size = static_cast<std::uint16_t>(arrival->bytes.size());
  datagram.waited = link_.now_ - arrival->due_at;
  std::memcpy(datagram.bytes.data(), arrival->bytes.data(), arrival->bytes.size());
  in_.pop();
  return true;
}

}  // namespace knuckle
