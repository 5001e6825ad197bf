// SecureLink's observers: they hear what the machine's loop says, sealed for each of them by the handshakes' thread.
#include <algorithm>

#include "transport/secure/dtls_session.h"
#include "transport/secure/secure_link.h"

namespace knuckle::secure {
namespace {

constexpr auto kGoneAfter = std::chrono::seconds(3);

}  // namespace

void SecureLink::admit_observer(Handshake& handshake, Clock::time_point now) {
  const Fingerprint peer = *handshake.session->peer();
  // With new keys it is the same one as before.
  std::erase_if(observers_,
                [&](const Observer& known) { return known.peer == peer && known.address == handshake.address; });
  if (observers_.size() >= access_.most_observers) {
    LinkEvent event = event_of(LinkEvent::Kind::kRefused, handshake.address, peer);
    event.refusal = access_.most_observers == 0 ? Refusal::kNoObservers : Refusal::kFull;
    put(event);
    return answer(handshake, event.refusal);
  }
  put(event_of(LinkEvent::Kind::kObserves, handshake.address, peer));
  Certificate certificate = handshake.session->peer_certificate();
  observers_.push_back({std::move(handshake.session), handshake.address, peer, std::move(certificate), now});
  observer_count_.store(static_cast<int>(observers_.size()), std::memory_order_relaxed);
}

/// @return whether it was one's. All that an observer can say is that it is there.
bool SecureLink::hear_observer(std::span<const std::uint8_t> bytes, const SocketAddress& from, Clock::time_point now) {
  if (bytes[0] >= kObserverTagMark) {
    const auto one = std::find_if(observers_.begin(), observers_.end(),
                                  [&](const Observer& observer) { return observer.session->mine(bytes); });
    if (one == observers_.end()) return true;
    Datagram unused;
    if (one->session->open(bytes, unused)) one->heard_at = now;
    if (one->session->closed()) one->heard_at = {};
    return true;
  }
  // Its last words of the handshake again, because ours were lost; a hello is a new beginning.
  const auto one = std::find_if(observers_.begin(), observers_.end(),
                                [&](const Observer& observer) { return observer.address == from; });
  if (one == observers_.end()) return false;
  HandshakeOut out(sockets_.unmarked, one->address);
  const bool hello = is_hello(bytes);
  if (!hello) (void)one->session->hear(bytes, out);
  return !hello;
}

void SecureLink::serve_observers(Clock::time_point now) {
  const std::size_t before = observers_.size();
  std::erase_if(observers_, [&](const Observer& observer) {
    if (now - observer.heard_at < kGoneAfter) return false;
    put(event_of(LinkEvent::Kind::kObserved, observer.address, observer.peer));
    return true;
  });
  if (observers_.size() != before || observers_.empty())
    observer_count_.store(static_cast<int>(observers_.size()), std::memory_order_relaxed);
  Datagram copy;
  Sealed sealed;
  while (copies_.pop(copy)) {
    for (const Observer& observer : observers_) {
      if (observer.session->seal(Inner::kMessage, copy.view(), sealed))
        (void)sockets_.marked.send(sealed.view(), observer.address);
    }
  }
}

}  // namespace knuckle::secure
