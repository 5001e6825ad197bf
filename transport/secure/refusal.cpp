#include "transport/secure/dtls_session.h"

namespace knuckle::secure {

const char* text(Refusal refusal) noexcept {
  switch (refusal) {
    case Refusal::kNone:
      return "none";
    case Refusal::kNoCertificate:
      return "the far end showed no certificate: it is no Knuckle program, or has no key (knuckle pair)";
    case Refusal::kUnknownPeer:
      return "the far end is not paired with this computer: compare fingerprints, then knuckle pair";
    case Refusal::kRevokedPeer:
      return "the far end's pairing was revoked here: knuckle pair pairs it anew";
    case Refusal::kExpiredPeer:
      return "the far end's certificate has expired, or one of the two clocks is wrong: make a new key there and pair";
    case Refusal::kNotKnownThere:
      return "the far end does not know this computer: pair there, too (knuckle pair)";
    case Refusal::kRevokedThere:
      return "the far end has revoked this computer's pairing";
    case Refusal::kExpiredThere:
      return "this computer's certificate has expired, or one of the two clocks is wrong: make a new key and pair";
    case Refusal::kProtocol:
      return "no DTLS 1.2 handshake with this version's cipher was possible: is it a Knuckle program, without "
             "--insecure?";
    case Refusal::kSilence:
      return "no answer: is the program running there, with this address and port, and does a firewall let UDP pass?";
    case Refusal::kBusy:
      return "somebody else has control";
    case Refusal::kFull:
      return "as many observers as it admits are connected there";
    case Refusal::kObserverThere:
      return "the far end lets this computer observe only: connect with --observe, or pair there without --observer";
    case Refusal::kObserver:
      return "the far end was paired as an observer and wants control: it connects with --observe, or is paired anew";
    case Refusal::kNoObservers:
      return "the far end admits no observers (--observers 0)";
    case Refusal::kPortClosed:
      return "no program listens on this port: start knuckle slave there, or check the port";
    case Refusal::kPlain:
      return "the far end runs with --insecure and this one does not: start both without it (or, in a lab, both with "
             "it)";
    case Refusal::kPairsThere:
      return "knuckle pair runs there, not knuckle slave: pair, or end it, and start knuckle slave";
    case Refusal::kNoPairThere:
      return "knuckle slave runs there, not knuckle pair: end it, or pair on another port";
    case Refusal::kWantsToPair:
      return "the far end runs knuckle pair, which only another knuckle pair answers: end this program meanwhile, or "
             "pair on another port";
    case Refusal::kWantsNoPairing:
      return "another program than knuckle pair asks here (knuckle master, console or doctor): it is not paired";
  }
  return "unknown";
}

}  // namespace knuckle::secure
