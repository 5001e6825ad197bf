// The secure link over real sockets: sessions, second operators, new keys, new addresses, strangers.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>

#include <functional>
#include <mutex>
#include <vector>

#include "tests/support/no_alloc.h"
#include "tests/support/refusal.h"
#include "tests/transport/secure/secure_rig.h"
#include "transport/link_messages.h"
#include "transport/other_version.h"
#include "transport/udp_link.h"

namespace knuckle::secure {
namespace {

bool says(const std::string& text, const std::string& what) {
  return text.find(what) != std::string::npos;
}

TEST_F(SecureLinkThreads, CarriesMessagesBothWaysBetweenPairedEnds) {
  End op = desk();
  ASSERT_TRUE(talk(op));
  ASSERT_EQ(machine.count(LinkEvent::Kind::kConnected), 1);
  EXPECT_EQ(machine.events[0].peer, desk_identity().fingerprint());
  EXPECT_EQ(text(machine.events[0]).find("connected: desk 1 ("), 0U) << text(machine.events[0]);
  EXPECT_EQ(op.link->problem(), "");
}

TEST_F(SecureLinkThreads, ASecondOperatorIsToldWhoHasControlUntilTheFirstLeaves) {
  End first = desk();
  ASSERT_TRUE(talk(first));
  End second = desk(other_identity());
  ASSERT_TRUE(until([&] {
    first.step(1);
    second.step(2);
    machine.step(3);
    return second.count(LinkEvent::Kind::kRefused) > 0;
  }));
  EXPECT_EQ(machine.heard, 1);
  EXPECT_EQ(second.messages, 0);
  EXPECT_EQ(second.count(LinkEvent::Kind::kConnected), 0) << "its session is for the answer alone";
  EXPECT_FALSE(second.link->has_control());
  EXPECT_TRUE(first.link->has_control());
  EXPECT_NE(text(second.events.back()).find("desk 1 has control there"), std::string::npos)
      << text(second.events.back());
  first.link->close();
  EXPECT_TRUE(talk(second));
  EXPECT_EQ(machine.count(LinkEvent::Kind::kClosed), 1);
}

TEST_F(SecureLinkThreads, AnEndThatBeginsAnewTakesItsPlaceAgain) {
  {
    End op = desk();
    ASSERT_TRUE(talk(op));
  }  // without a farewell, as a killed program
  End again = desk();
  EXPECT_TRUE(talk(again, 9));
}

TEST_F(SecureLinkThreads, StrangersAreRefusedAndNamedWithWhy) {
  const Identity stranger = make_identity("stranger");
  End unknown = desk(stranger);
  ASSERT_TRUE(until([&] {
    unknown.step(1);
    machine.step(2);
    return machine.count(LinkEvent::Kind::kRefused) > 0 && !unknown.link->problem().empty();
  }));
  EXPECT_EQ(machine.messages, 0);
  EXPECT_EQ(machine.events[0].refusal, Refusal::kUnknownPeer);
  EXPECT_EQ(machine.events[0].peer, stranger.fingerprint());
  EXPECT_NE(unknown.link->problem().find("does not know this computer"), std::string::npos) << unknown.link->problem();
}

/// A network address translator whose outer port may change.
class Translator {
 public:
  explicit Translator(std::uint16_t machine_port)
      : machine_(parse_address("127.0.0.1:" + std::to_string(machine_port))) {}
  [[nodiscard]] std::uint16_t port() const { return local_address(inner_.descriptor()).port(); }
  void move() { outer_ = make(); }
  void step() {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto arrival = inner_.receive(bytes, from)) {
      desk_ = from;
      (void)outer_.send(std::span(bytes).first(arrival->size), machine_);
    }
    while (const auto arrival = outer_.receive(bytes, from)) {
      (void)inner_.send(std::span(bytes).first(arrival->size), desk_);
    }
  }
  /// Somebody on the way answers the desk as a plain machine's side does.
  void claim_plain() {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (inner_.receive(bytes, from)) (void)inner_.send(kPlainHere, from);
  }
  /// What the desk says goes out by somebody else's socket; the answers to it are not for the desk.
  void step_through(const UdpSocket& thief) {
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto arrival = inner_.receive(bytes, from))
      (void)thief.send(std::span(bytes).first(arrival->size), machine_);
  }

 private:
  static UdpSocket make() { return UdpSocket(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, "")); }
  UdpSocket inner_ = make(), outer_ = make();
  SocketAddress machine_, desk_;
};

TEST_F(SecureLinkThreads, SaysThatNobodyAnswers) {
  SecureLinkTiming soon;
  soon.answer = 300ms;
  const UdpSocket silent(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, ""));
  const auto nobody =
      SecureLink::connect(text(local_address(silent.descriptor())), desk_identity(), {peer(machine_identity())}, soon);
  EXPECT_TRUE(until([&] { return says(nobody->problem(), "no answer"); }));
}

TEST_F(SecureLinkThreads, SaysThatNoProgramHasThePortBeforeAnyTimeIsUp) {
  SecureLinkTiming never;
  never.answer = 1h;
  for (const char* closed : {"127.0.0.1:9", "[::1]:9"}) {
    const auto nobody = SecureLink::connect(closed, desk_identity(), {peer(machine_identity())}, never);
    EXPECT_TRUE(until([&] { return says(nobody->problem(), "no program listens on this port"); })) << closed;
  }
}

TEST_F(SecureLinkThreads, ConnectsToAPortWhereAProgramBeginsToListenLater) {
  const std::string there = address();
  machine.link.reset();
  End op{SecureLink::connect(there, desk_identity(), {peer(machine_identity())})};
  ASSERT_TRUE(until([&] { return says(op.link->problem(), "no program listens"); }));
  machine.link = SecureLink::listen(there, machine_identity(), desks());
  EXPECT_TRUE(talk(op));
  EXPECT_TRUE(until([&] { return op.link->problem().empty(); }));
}

TEST_F(SecureLinkThreads, APlainOperatorAndAnEncryptedMachineEachNameTheOther) {
  UdpLink plain = UdpLink::connect(address());
  ASSERT_TRUE(until([&] {
    (void)plain.send(encode(MasterMessage{}).view());
    Datagram datagram;
    EXPECT_FALSE(plain.receive(datagram));
    machine.step(1);
    return plain.heard_encrypted() && machine.count(LinkEvent::Kind::kRefused) > 0;
  }));
  EXPECT_EQ(machine.events[0].refusal, Refusal::kPlain);
  EXPECT_EQ(machine.messages, 0);
}

TEST_F(SecureLinkThreads, AnEndKnowsWhichVersionTheFarEndsMessagesAreOf) {
  End op = desk();
  ASSERT_TRUE(talk(op));
  EXPECT_EQ(machine.link->other_version(), 0);
  Datagram old = encode(MasterMessage{}), datagram;
  old.bytes[2] = 7;
  EXPECT_TRUE(until([&] {
    (void)op.link->send(old.view());
    (void)machine.link->receive(datagram);
    return machine.link->other_version() == 7;
  }));
}

TEST_F(SecureLinkThreads, AnEncryptedOperatorAndAPlainMachineEachNameTheOther) {
  UdpLink plain = UdpLink::listen("127.0.0.1:0");
  const auto op =
      SecureLink::connect("127.0.0.1:" + std::to_string(plain.port()), desk_identity(), {peer(machine_identity())});
  ASSERT_TRUE(until([&] {
    Datagram datagram;
    EXPECT_FALSE(plain.receive(datagram));
    return plain.heard_encrypted() && says(op->problem(), "runs with --insecure");
  }));
  EXPECT_FALSE(plain.send(encode(SlaveMessage{}).view())) << "nobody is connected";
}

TEST_F(SecureLinkThreads, WhoeverClaimsThatTheFarEndIsPlainDoesNotEndTheHandshake) {
  Translator translator(machine.link->port());
  End op{SecureLink::connect("127.0.0.1:" + std::to_string(translator.port()), desk_identity(),
                             {peer(machine_identity())})};
  ASSERT_TRUE(until([&] {
    translator.claim_plain();
    return says(op.link->problem(), "runs with --insecure");
  }));
  EXPECT_TRUE(until([&] {
    op.step(1);
    translator.step();
    machine.step(2);
    return op.heard == 2;
  }));
}

TEST_F(SecureLinkThreads, FollowsAChangedAddressOnceItAnswersFromThere) {
  Translator translator(machine.link->port());
  End op{SecureLink::connect("127.0.0.1:" + std::to_string(translator.port()), desk_identity(),
                             {peer(machine_identity())})};
  const auto both = [&] {
    op.step(1);
    translator.step();
    machine.step(2);
    translator.step();
  };
  ASSERT_TRUE(until([&] {
    both();
    return op.heard == 2;
  }));
  translator.move();
  ASSERT_TRUE(until([&] {
    both();
    return machine.count(LinkEvent::Kind::kMoved) == 1;
  }));
  op.heard = 0;
  ASSERT_TRUE(until([&] {
    both();
    return op.heard == 2;
  }));
  EXPECT_EQ(machine.count(LinkEvent::Kind::kConnected), 1) << "the same session";
}

TEST_F(SecureLinkThreads, WhoHadControlIsNotHeardAfterSomebodyElseTookIt) {
  Translator translator(machine.link->port());
  End first{SecureLink::connect("127.0.0.1:" + std::to_string(translator.port()), desk_identity(),
                                {peer(machine_identity())})};
  ASSERT_TRUE(until([&] {
    first.step(1);
    translator.step();
    machine.step(3);
    translator.step();
    return machine.heard == 1;
  }));
  for (int i = 0; i < 20; ++i) first.step(1);  // these are under way for longer than the link lasts
  End second = desk(other_identity());
  ASSERT_TRUE(until([&] {
    second.step(2);
    machine.step(3);
    return machine.heard == 2;
  }));
  translator.step();
  for (int i = 0; i < 50; ++i) {
    machine.step(3);
    EXPECT_EQ(machine.heard, 2);
    ::poll(nullptr, 0, 2);
  }
}

TEST_F(SecureLinkThreads, ACopySentFromElsewhereTakesNothingAway) {
  Translator translator(machine.link->port());
  End op{SecureLink::connect("127.0.0.1:" + std::to_string(translator.port()), desk_identity(),
                             {peer(machine_identity())})};
  ASSERT_TRUE(until([&] {
    op.step(1);
    translator.step();
    machine.step(2);
    translator.step();
    return op.heard == 2;
  }));
  // A thief holds every datagram back and sends it from an address of its own, first.
  const UdpSocket thief(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, ""));
  for (int i = 0; i < 100; ++i) {
    op.step(1);
    translator.step_through(thief);
    machine.step(2);
    std::array<std::uint8_t, 2048> bytes;
    SocketAddress from;
    while (const auto got = thief.receive(bytes, from))
      EXPECT_LT(got->size, 80U) << "a question, not the machine's words";
    ::poll(nullptr, 0, 2);
  }
  EXPECT_EQ(machine.count(LinkEvent::Kind::kMoved), 0);
}

TEST_F(SecureLinkThreads, JunkAndAHandshakeFloodReachNoLoop) {
  End op = desk();
  ASSERT_TRUE(talk(op));
  const UdpSocket attacker(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, ""));
  const SocketAddress target = parse_address(address());
  Bytes hello(200, 0), tagged(60, 0xD0), empty;
  hello[0] = 22;
  hello[1] = 0xFE;
  hello[2] = 0xFF;
  for (int i = 0; i < 5000; ++i) {
    (void)attacker.send(hello, target);
    (void)attacker.send(tagged, target);
    (void)attacker.send(empty, target);
  }
  const int before = machine.messages;
  for (int i = 0; i < 20; ++i) {
    op.step(1);
    machine.step(2);
  }
  EXPECT_GE(machine.messages - before, 19) << "nothing stood before them in the queue";
  EXPECT_EQ(machine.count(LinkEvent::Kind::kConnected), 1);
}

TEST_F(SecureLinkThreads, AllocatesNothingPerMessage) {
  End op = desk();
  ASSERT_TRUE(talk(op));
  const Bytes bytes(300, 1);
  Datagram datagram;
  int heard = 0;
  const test::NoAllocScope scope;
  for (int i = 0; i < 500; ++i) {
    (void)op.link->send(bytes);
    heard += machine.link->receive(datagram) ? 1 : 0;
    (void)machine.link->send(bytes);
    heard += op.link->receive(datagram) ? 1 : 0;
  }
  const auto allocations = scope.allocations();
  EXPECT_EQ(allocations, 0U);
  EXPECT_GE(heard, 990);
}

TEST_F(SecureLinkThreads, RefusesAPortThatAnotherProgramHas) {
  const std::string said = test::refusal([&] { (void)SecureLink::listen(address(), machine_identity(), desks()); });
  EXPECT_NE(said.find("another program has this port"), std::string::npos) << said;
}

TEST_F(SecureLinkThreads, FindsAnEndByItsName) {
  End op{SecureLink::connect("localhost:" + std::to_string(machine.link->port()), desk_identity(),
                             {peer(machine_identity())})};
  EXPECT_TRUE(talk(op));
}

TEST_F(SecureLinkThreads, WhoHasControlIsAskedAndMayGrantIt) {
  End first = desk();
  ASSERT_TRUE(talk(first));
  End second = desk(other_identity());
  const auto all = [&] {
    first.step(1);
    second.step(2);
    machine.step(3);
  };
  ASSERT_TRUE(until([&] {
    all();
    return first.count(LinkEvent::Kind::kAsked) > 0;
  }));
  const LinkEvent asked = first.events.back();
  EXPECT_EQ(asked.peer, other_identity().fingerprint());
  EXPECT_EQ(text(asked).find("desk 2 ("), 0U) << text(asked);
  EXPECT_EQ(machine.heard, 1) << "asking alone changes nothing";
  EXPECT_EQ(second.messages, 0);
  first.link->grant(asked.peer);
  ASSERT_TRUE(until([&] {
    all();
    return machine.heard == 2 && second.heard == 3;
  }));
  ASSERT_EQ(machine.count(LinkEvent::Kind::kGranted), 1);
  const auto granted = std::find_if(machine.events.begin(), machine.events.end(),
                                    [](const LinkEvent& event) { return event.kind == LinkEvent::Kind::kGranted; });
  EXPECT_TRUE(says(text(*granted), " lets desk 2 (")) << text(*granted);
  for (int i = 0; i < 300; ++i) {
    all();
    EXPECT_EQ(machine.heard, 2) << "who granted it is not heard any more, and does not ask by itself";
    ::poll(nullptr, 0, 5);
  }
  EXPECT_EQ(second.count(LinkEvent::Kind::kAsked), 0);
  first.link->take_control();
  EXPECT_TRUE(until([&] {
    all();
    return second.count(LinkEvent::Kind::kAsked) == 1;
  }));
}

TEST_F(SecureLinkThreads, AfterAHandOverTheLoopHearsNobodyForLongerThanItsLossPolicyWaits) {
  End first = desk();
  ASSERT_TRUE(talk(first));
  End second = desk(other_identity());
  first.link->release();
  using Clock = std::chrono::steady_clock;
  std::optional<Clock::time_point> connected_at;
  ASSERT_TRUE(until([&] {
    first.step(1);
    second.step(2);
    machine.step(3);
    if (!connected_at && machine.count(LinkEvent::Kind::kConnected) == 2) connected_at = Clock::now();
    return machine.heard == 2;
  }));
  EXPECT_GE(Clock::now() - *connected_at, kHandOverGap - 10ms);
}

TEST_F(SecureLinkThreads, ASecondProgramWithTheSameKeyIsASecondOperator) {
  End first = desk();
  ASSERT_TRUE(talk(first));
  End second = desk();
  ASSERT_TRUE(until([&] {
    first.step(1);
    second.step(2);
    machine.step(3);
    return second.count(LinkEvent::Kind::kRefused) > 0;
  }));
  EXPECT_EQ(machine.heard, 1);
  EXPECT_EQ(machine.count(LinkEvent::Kind::kConnected), 1);
}

/// Peers that change while the link is in use.
struct ChangingPeers {
  std::mutex mutex;
  std::optional<Peers> next;
  std::function<std::optional<Peers>()> reader() {
    return [this] {
      const std::lock_guard lock(mutex);
      return std::exchange(next, std::nullopt);
    };
  }
  void change(Peers peers) {
    const std::lock_guard lock(mutex);
    next = std::move(peers);
  }
};

TEST_F(SecureLinkThreads, ARevokedEndThatIsConnectedLosesTheLink) {
  ChangingPeers known;
  machine.link = SecureLink::listen("127.0.0.1:0", machine_identity(), desks(), {}, {.newer_peers = known.reader()});
  End op = desk();
  ASSERT_TRUE(talk(op));
  known.change({peer(desk_identity(), true), peer(other_identity())});
  ASSERT_TRUE(until([&] {
    op.step(1);
    machine.step(2);
    return machine.count(LinkEvent::Kind::kCutOff) == 1 && !op.link->problem().empty();
  }));
  EXPECT_EQ(machine.events.back().refusal, Refusal::kRevokedPeer);
  EXPECT_NE(op.link->problem().find("has revoked this computer"), std::string::npos) << op.link->problem();
  const int before = machine.messages;
  for (int i = 0; i < 50; ++i) {
    op.step(1);
    machine.step(2);
    ::poll(nullptr, 0, 2);
  }
  EXPECT_EQ(machine.messages, before);
  End other = desk(other_identity());
  EXPECT_TRUE(talk(other)) << "and whoever is still paired may come";
}

TEST_F(SecureLinkThreads, NothingIsLeftToSealPicturesWithOnceASessionHasEnded) {
  ChangingPeers known;
  machine.link = SecureLink::listen("127.0.0.1:0", machine_identity(), desks(), {}, {.newer_peers = known.reader()});
  const auto ends_by = [&](End& op, const std::function<void()>& act) {
    EXPECT_TRUE(talk(op));
    std::optional<VideoSecret> secret;
    EXPECT_TRUE(machine.link->take(secret) && secret);
    act();
    EXPECT_TRUE(until([&] {
      op.step(1);
      machine.step(2);
      return machine.link->take(secret);
    }));
    EXPECT_FALSE(secret);
  };
  {
    End released = desk(other_identity());
    ends_by(released, [&] { released.link->release(); });
  }
  {
    End left = desk(other_identity());
    ends_by(left, [&] { left.link->close(); });
  }
  End revoked = desk();
  ends_by(revoked, [&] { known.change({peer(desk_identity(), true), peer(other_identity())}); });
  End last = desk(other_identity());
  ends_by(last, [&] { machine.link->close(); });
}

TEST_F(SecureLinkThreads, ObserversHearTheMachineAndAreNotHeard) {
  machine.link = SecureLink::listen("127.0.0.1:0", machine_identity(), desks(), {}, {.most_observers = 2});
  End op = desk();
  ASSERT_TRUE(talk(op));
  SecureLinkAccess observing;
  observing.purpose = Purpose::kObserve;
  End one = desk(other_identity(), {}, observing), two = desk(desk_identity(), {}, observing);
  const auto all = [&] {
    op.step(1);
    one.step(8);
    two.step(9);
    machine.step(3);
    EXPECT_EQ(machine.heard, 1);
  };
  ASSERT_TRUE(until([&] {
    all();
    return one.heard == 3 && two.heard == 3;
  }));
  EXPECT_FALSE(one.link->send(Bytes{1}));
  EXPECT_EQ(machine.count(LinkEvent::Kind::kObserves), 2);
  EXPECT_EQ(machine.count(LinkEvent::Kind::kConnected), 1);
  End third = desk(other_identity(), {}, observing);
  ASSERT_TRUE(until([&] {
    all();
    third.step(1);
    return third.count(LinkEvent::Kind::kRefused) > 0;
  }));
  EXPECT_EQ(third.events.back().refusal, Refusal::kFull);
  EXPECT_EQ(third.messages, 0);
  third.link->close();
  one.link->close();
  one.heard = 0;
  EXPECT_TRUE(until([&] {
    op.step(1);
    machine.step(3);
    return machine.count(LinkEvent::Kind::kObserved) == 1;
  }));
}

TEST_F(SecureLinkThreads, AMachineWithoutObserversSaysSo) {
  SecureLinkAccess none, observing;
  none.most_observers = 0;
  observing.purpose = Purpose::kObserve;
  machine.link = SecureLink::listen("127.0.0.1:0", machine_identity(), desks(), {}, none);
  End watcher = desk(desk_identity(), {}, observing);
  EXPECT_TRUE(until([&] {
    watcher.step(1);
    machine.step(2);
    return says(watcher.link->problem(), "admits no observers");
  }));
  EXPECT_EQ(machine.events[0].refusal, Refusal::kNoObservers);
}

TEST_F(SecureLinkThreads, WhoIsPairedAsAnObserverGetsNoControl) {
  Peer watching = peer(other_identity());
  watching.observer = true;
  machine.link = SecureLink::listen("127.0.0.1:0", machine_identity(), {watching});
  End op = desk(other_identity());
  ASSERT_TRUE(until([&] {
    op.step(1);
    machine.step(2);
    return machine.count(LinkEvent::Kind::kRefused) > 0 && !op.link->problem().empty();
  }));
  EXPECT_EQ(machine.events[0].refusal, Refusal::kObserver);
  EXPECT_NE(op.link->problem().find("--observe"), std::string::npos) << op.link->problem();
  SecureLinkAccess observing;
  observing.purpose = Purpose::kObserve;
  End watcher = desk(other_identity(), {}, observing);
  EXPECT_TRUE(until([&] {
    watcher.step(1);
    machine.step(2);
    return watcher.heard == 2;
  }));
  EXPECT_EQ(machine.messages, 0);
}

TEST_F(SecureLinkThreads, ObserversCostTheLoopNoAllocation) {
  SecureLinkAccess observing;
  observing.purpose = Purpose::kObserve;
  End watcher = desk(other_identity(), {}, observing);
  ASSERT_TRUE(until([&] {
    watcher.step(1);
    machine.step(2);
    return watcher.heard == 2;
  }));
  const Bytes bytes(300, 1);
  const test::NoAllocScope scope;
  for (int i = 0; i < 500; ++i) (void)machine.link->send(bytes);
  EXPECT_EQ(scope.allocations(), 0U);
}

}  // namespace
}  // namespace knuckle::secure
