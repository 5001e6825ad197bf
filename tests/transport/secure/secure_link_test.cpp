// The secure link over real sockets: sessions, second operators, new keys, new addresses, strangers.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>

#include <functional>
#include <vector>

#include "tests/support/no_alloc.h"
#include "tests/support/says.h"
#include "tests/transport/secure/secure_rig.h"
#include "transport/link_messages.h"
#include "transport/other_version.h"
#include "transport/udp_link.h"

namespace knuckle::secure {
namespace {

using test::says;

TEST_F(SecureLinkThreads, CarriesMessagesBothWaysBetweenPairedEndsThatFindEachOtherByName) {
  End op{SecureLink::connect("localhost:" + std::to_string(machine.link->port()), desk_identity(),
                             {peer(machine_identity())})};
  ASSERT_TRUE(talk(op));
  ASSERT_EQ(machine.count(LinkEvent::Kind::kConnected), 1);
  EXPECT_EQ(machine.events[0].peer, desk_identity().fingerprint());
  EXPECT_TRUE(test::begins(text(machine.events[0]), "connected: desk 1 ("));
  EXPECT_EQ(op.link->problem(), "");
}

TEST_F(SecureLinkThreads, ASecondOperatorIsToldWhoHasControlUntilTheFirstLeavesAlsoWithTheSameKey) {
  for (const Identity* identity : {&other_identity(), &desk_identity()}) {
    machine = End{listening()};
    End first = desk();
    ASSERT_TRUE(talk(first, 1));
    End second = desk(*identity);
    ASSERT_TRUE(talk_until(first, 1, [&] {
      second.step(2);
      return second.count(LinkEvent::Kind::kRefused) > 0;
    }));
    EXPECT_EQ(machine.heard, 1);
    EXPECT_EQ(machine.count(LinkEvent::Kind::kConnected), 1);
    EXPECT_EQ(second.messages, 0);
    EXPECT_EQ(second.count(LinkEvent::Kind::kConnected), 0) << "its session is for the answer alone";
    EXPECT_FALSE(second.link->has_control());
    EXPECT_TRUE(first.link->has_control());
    EXPECT_TRUE(says(text(second.events.back()), "desk 1 has control there"));
    first.link->close();
    EXPECT_TRUE(talk(second));
    EXPECT_EQ(machine.count(LinkEvent::Kind::kClosed), 1);
  }
}

TEST_F(SecureLinkThreads, WhoIsNotLetInIsToldWhyAndNamed) {
  const Identity stranger = make_identity("stranger");
  Peer watching = peer(other_identity());
  watching.observer = true;
  struct Case {
    const Identity& comes;
    Purpose purpose;
    Refusal refusal;
    const char* told;
  };
  const Case cases[]{
      {stranger, Purpose::kControl, Refusal::kUnknownPeer, "does not know this computer"},
      {other_identity(), Purpose::kControl, Refusal::kObserver, "--observe"},
      {desk_identity(), Purpose::kObserve, Refusal::kNoObservers, "admits no observers"},
  };
  for (const Case& c : cases) {
    machine = End{SecureLink::listen("127.0.0.1:0", machine_identity(), {peer(desk_identity()), watching}, {},
                                     {.most_observers = 0})};
    End op = desk(c.comes, {}, {.purpose = c.purpose});
    EXPECT_TRUE(talk_until(op, 1, [&] {
      return machine.count(LinkEvent::Kind::kRefused) > 0 && says(op.link->problem(), c.told);
    })) << op.link->problem();
    EXPECT_EQ(machine.messages, 0);
    EXPECT_EQ(machine.events.at(0).refusal, c.refusal) << c.told;
    EXPECT_EQ(machine.events.at(0).peer, c.comes.fingerprint()) << c.told;
  }
}

/// A network address translator whose outer port may change.
class Translator {
 public:
  explicit Translator(const std::string& machine) : machine_(parse_address(machine)) {}
  [[nodiscard]] End desk() const {
    return {SecureLink::connect(text(local_address(inner_.descriptor())), desk_identity(), {peer(machine_identity())})};
  }
  void move() { outer_ = SecureLinkThreads::bound_socket(); }
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

 private:
  UdpSocket inner_ = SecureLinkThreads::bound_socket(), outer_ = SecureLinkThreads::bound_socket();
  SocketAddress machine_, desk_;
};

TEST_F(SecureLinkThreads, SaysThatNobodyAnswers) {
  SecureLinkTiming soon;
  soon.answer = 300ms;
  const UdpSocket silent = bound_socket();
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
  Translator translator(address());
  End op = translator.desk();
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
  Translator translator(address());
  End op = translator.desk();
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

TEST_F(SecureLinkThreads, JunkAndAHandshakeFloodReachNoLoop) {
  End op = desk();
  ASSERT_TRUE(talk(op));
  const UdpSocket attacker = bound_socket();
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

TEST_F(SecureLinkThreads, AllocatesNothingPerMessageAlsoWithAnObserver) {
  End op = desk(), watcher = screen(other_identity());
  ASSERT_TRUE(talk(op));
  ASSERT_TRUE(talk_until(watcher, 1, [&] { return watcher.heard == 9; }));
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

TEST_F(SecureLinkThreads, ARevokedEndThatIsConnectedLosesTheLink) {
  End op = desk();
  ASSERT_TRUE(talk(op));
  change_peers({peer(desk_identity(), true), peer(other_identity())});
  ASSERT_TRUE(talk_until(op, 1, [&] {
    return machine.count(LinkEvent::Kind::kCutOff) == 1 && says(op.link->problem(), "has revoked this computer");
  })) << op.link->problem();
  EXPECT_EQ(machine.events.back().refusal, Refusal::kRevokedPeer);
  const int before = machine.messages;
  run(20, [&] { op.step(1); });
  EXPECT_EQ(machine.messages, before);
  End other = desk(other_identity());
  EXPECT_TRUE(talk(other)) << "and whoever is still paired may come";
}

TEST_F(SecureLinkThreads, NothingIsLeftToSealPicturesWithOnceASessionHasEnded) {
  struct Case {
    const char* ends;
    std::function<void(End& op)> act;
  };
  const Case cases[]{
      {"released", [](End& op) { op.link->release(); }},
      {"left", [](End& op) { op.link->close(); }},
      {"revoked",
       [this](End&) {
         change_peers({peer(desk_identity(), true), peer(other_identity())});
       }},
      {"the machine's side ends", [this](End&) { machine.link->close(); }},
  };
  for (const Case& c : cases) {
    machine = End{listening()};
    End op = desk();
    EXPECT_TRUE(talk(op));
    std::optional<VideoSecret> secret;
    EXPECT_TRUE(machine.link->take(secret) && secret);
    c.act(op);
    EXPECT_TRUE(talk_until(op, 1, [&] { return machine.link->take(secret); })) << c.ends;
    EXPECT_FALSE(secret) << c.ends;
  }
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

TEST_F(SecureLinkThreads, WhoIsPairedAsAnObserverMayLookOn) {
  Peer watching = peer(other_identity());
  watching.observer = true;
  machine.link = SecureLink::listen("127.0.0.1:0", machine_identity(), {watching});
  End watcher = screen(other_identity());
  EXPECT_TRUE(talk_until(watcher, 1, [&] { return watcher.heard == 9; }));
  EXPECT_EQ(machine.messages, 0);
}

}  // namespace
}  // namespace knuckle::secure
